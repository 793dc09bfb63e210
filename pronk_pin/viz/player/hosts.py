"""Which hosts the live page answers to, so that a stranger's web page cannot read it.

A page of another site cannot read from ours, as its origin is another. It can have the name of its
own site resolve to this machine, though, once it is loaded ("DNS rebinding"): to the browser the
two are then one site. What gives it away is the name, which stands in the request's `Host`.
"""

from __future__ import annotations

import ipaddress
import re
import socket
from collections.abc import Iterable
from dataclasses import dataclass
from urllib.parse import urlsplit

_LOOPBACK = ("localhost", "127.0.0.1", "::1")
_HOST = re.compile(r"(?:\[(?P<six>[^\[\]]+)\]|(?P<name>[^:\[\]]+))(?::(?P<port>\d{1,5}))?")


@dataclass(frozen=True)
class Hosts:
    """The names and addresses of a page, and its port.

    - Bound to this machine only: `localhost`, `127.0.0.1` and `::1`, and the host it was bound to.
    - Bound to another address: that host, this machine's host name, short and in full, and the
      addresses bound.
    - Bound to all addresses: all of those, and the address that a request has arrived at.

    Attributes:
        names: Names and addresses in one spelling, see `spelled`.
        port: Port that the page is at.
        everywhere: Whether it is bound to all addresses.
    """

    names: frozenset[str]
    port: int
    everywhere: bool = False

    @classmethod
    def of(cls, host: str, sockets: Iterable[socket.socket]) -> Hosts:
        """Those of a page that was asked to listen at a host, and listens at these sockets."""
        bound = [listening.getsockname() for listening in sockets]
        addresses = [ipaddress.ip_address(name[0].partition("%")[0]) for name in bound]
        everywhere = any(address.is_unspecified for address in addresses)
        names = [host, *(name[0] for name in bound)]
        if everywhere or all(address.is_loopback for address in addresses):
            names += _LOOPBACK
        if not all(address.is_loopback for address in addresses):
            names += [socket.gethostname(), socket.getfqdn()]
        return cls(frozenset(spelled(name) for name in names if name), bound[0][1], everywhere)

    def answers(self, host: str | None, *, arrived_at: str = "") -> bool:
        """Whether the page answers to a `Host`, as "localhost:7000"; without a port, too.

        Args:
            host: The header; nobody that sends none is answered.
            arrived_at: Address of this machine that the request has arrived at.
        """
        return self._known(host or "", missing=self.port, arrived_at=arrived_at)

    def trusts(self, origin: str, *, arrived_at: str = "") -> bool:
        """Whether a page of an `Origin`, as "http://localhost:7000", may listen to the stream."""
        try:
            parts = urlsplit(origin)
        except ValueError:
            return False
        default = {"http": 80, "https": 443}.get(parts.scheme, 0)
        return self._known(parts.netloc, missing=default, arrived_at=arrived_at)

    def _known(self, host: str, *, missing: int, arrived_at: str) -> bool:
        """Whether a host and its port, or the one that it means without any, are the page's."""
        found = _HOST.fullmatch(host)
        if found is None or int(found["port"] or missing) != self.port:
            return False
        name = spelled(found["six"] or found["name"])
        return name in self.names or (self.everywhere and name == spelled(arrived_at))


def spelled(name: str) -> str:
    """A name or an address in one spelling: small letters, addresses as short as can be."""
    name = name.lower().removesuffix(".").partition("%")[0]  # without an interface's name
    try:
        address = ipaddress.ip_address(name)
    except ValueError:
        return name
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return str(mapped or address)


def url_of(host: str, port: int) -> str:
    """The address of a page; those of IPv6 stand in brackets."""
    shown = f"[{host.replace('%', '%25')}]" if ":" in host else host or "localhost"
    return f"http://{shown}:{port}/"
