"""Strides as a file: NetCDF-4 with checksums, the same bytes each time."""

from __future__ import annotations

import contextlib
import json
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import netCDF4
import numpy as np
import xarray as xr

from ...errors import FileProblem, cannot_write
from ...storage import reading
from ..experiment import Definition, differences, fingerprint
from .remedies import SIMULATE_AGAIN

_LARGEST = 2**33
"""Size beyond which strides are not unpacked [bytes]."""


def decode(data: bytes, path: Path, remedy: str) -> xr.Dataset:
    """Open a dataset that `encode` has made; its variables are read when they are asked for.

    Args:
        data: The file's bytes.
        path: Where they come from, for the error.
        remedy: What to do where they are damaged.

    Raises:
        FileProblem: They are no such file, or say that they hold too much.
    """
    with reading(path, remedy):
        store = xr.backends.NetCDF4DataStore(  # type: ignore[no-untyped-call]
            netCDF4.Dataset(path.name, memory=data)
        )
        file = xr.open_dataset(store)
        if file.nbytes > _LARGEST:
            raise ValueError(f"it says that it has {file.nbytes / 1e9:.0f} GB")
    return file


def check_fingerprint(file: xr.Dataset, path: Path, wanted: Definition) -> None:
    """Refuse strides that are not of the simulation that is asked for.

    Args:
        file: The strides.
        path: Where they come from, for the error.
        wanted: Definition of the simulation.

    Raises:
        FileProblem: They are of another one; it says in what it differs.
    """
    if file.attrs.get("fingerprint") != fingerprint(wanted):
        raise FileProblem(
            path, f"is of another simulation ({_mismatch(file, wanted)})", SIMULATE_AGAIN
        )


def _mismatch(file: xr.Dataset, wanted: Definition) -> str:
    """What a file of strides is of, as far as that is not what is wanted."""
    text = file.attrs.get("definition")
    if not isinstance(text, str):
        return "it does not say of which"
    try:
        return differences(json.loads(text), wanted) or "its fingerprint is not its own"
    except ValueError:
        return "it does not say of which"


def join_speeds(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """The strides of several batches of speeds as one dataset, with NaN where one has fewer."""
    if len(parts) == 1:
        return parts[0]
    numbered = [part.assign_coords(tick=np.arange(part.sizes["tick"])) for part in parts]
    joined = xr.concat(
        numbered, dim="speed", data_vars="all", join="outer", combine_attrs="drop_conflicts"
    )
    return joined.drop_vars("tick").sortby("speed")


def encode(strides: xr.Dataset) -> bytes:
    """A dataset as a NetCDF-4 file with checksums (Fletcher-32), the same bytes each time."""
    packed = {"zlib": True, "complevel": 1, "shuffle": True, "fletcher32": True}
    encoding = {
        name: packed if variable.ndim > 2 else {"fletcher32": True}
        for name, variable in strides.variables.items()
        if variable.ndim and variable.dtype.kind in "fiub"
    }
    with _scratch_file() as path:
        strides.to_netcdf(path, engine="netcdf4", encoding=encoding)
        return path.read_bytes()


@contextlib.contextmanager
def _scratch_file() -> Iterator[Path]:
    """A temporary file for a library that writes by name.

    Raises:
        FileProblem: There is no room for it.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="pronk_pin-") as folder:
            yield Path(folder) / "strides.nc"
    except (OSError, RuntimeError) as error:
        remedy = "make room for temporary files, or set TMPDIR"
        raise cannot_write(tempfile.gettempdir(), error, remedy) from error
