"""The one place where single values that a user passes in are checked: numbers, names, objects.

Each check takes the parameter's name and its value, and returns the value in the form that the
package counts on (a `float` for `np.float64(3)`, a tuple for a list) or raises `InvalidInput`,
which tells the parameter, the value and what was wanted. States and arrays are checked in
`pronk_pin.robot.state`.
"""

from __future__ import annotations

import math
import operator
import os
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from .errors import InvalidInput, UnknownName

T = TypeVar("T")

LARGEST_SEED = 2**63 - 1
"""Seeds are kept as 64-bit numbers in the files of a result."""

_LONGEST_NAME = 100
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9+\-_.=]*")
_SHOWN = 60
"""Characters of a wrong value that a message shows."""


@dataclass(frozen=True)
class Interval:
    """The numbers that a parameter may be.

    Attributes:
        low, high: Its ends.
        unit: Unit of the numbers, for the message.
        above: Whether the lower end does not belong to it.
        below: Whether the upper end does not.
    """

    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    above: bool = False
    below: bool = False

    def __contains__(self, value: float) -> bool:
        over = value > self.low if self.above else value >= self.low
        under = value < self.high if self.below else value <= self.high
        return over and under

    def __str__(self) -> str:
        """In words: "from 0 to 10 kg", "above 0", "from 1 on"."""
        unit = f" {self.unit}" if self.unit else ""
        first = f"{'above' if self.above else 'from'} {self.low:.15g}"
        last = f"{'below' if self.below else 'up to'} {self.high:.15g}"
        if math.isinf(self.low) and math.isinf(self.high):
            return unit and f"in{unit}"
        if math.isinf(self.high):
            return f"{first}{unit}" if self.above else f"{first}{unit} on"
        if math.isinf(self.low):
            return f"{last}{unit}"
        if self.above or self.below:
            return f"{first}, {last}{unit}"
        return f"{first} to {self.high:.15g}{unit}"


ANY = Interval()
NOT_NEGATIVE = Interval(0.0)
POSITIVE = Interval(0.0, above=True)
SHARE = Interval(0.0, 1.0)


def shown(value: object) -> str:
    """A value as a message shows it, in one line and not too long."""
    if isinstance(value, np.generic):
        value = value.item()
    try:
        text = " ".join(repr(value).split())
    except Exception:  # of a foreign object, whose __repr__ may do anything
        text = _with_article(type(value).__name__)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."


def real(name: str, value: Any, within: Interval = ANY) -> float:
    """A finite number within an interval, as a float; a bool is no number."""
    number = _number(value)
    if number is None:
        raise InvalidInput(f"{name}={shown(value)} is {_kind(value)}; {_give('number', within)}")
    if not math.isfinite(number) or number not in within:
        raise InvalidInput(f"{name}={shown(value)}; {_give('number', within)}")
    return number


def whole(name: str, value: Any, within: Interval = ANY) -> int:
    """A whole number within an interval, as an int; 3.0 and True are none."""
    try:
        if isinstance(value, bool | np.bool_):
            raise TypeError
        number = operator.index(value)
    except TypeError:
        kind = _kind(value)
        raise InvalidInput(
            f"{name}={shown(value)} is {kind}; {_give('whole number', within)}"
        ) from None
    if number not in within:
        raise InvalidInput(f"{name}={shown(value)}; {_give('whole number', within)}")
    return number


def seed(name: str, value: Any) -> int:
    """A seed of random numbers: a whole number from 0 on that 64 bits can hold."""
    number = whole(name, value, NOT_NEGATIVE)
    if number > LARGEST_SEED:
        raise InvalidInput(f"{name}={shown(value)}; give a whole number from 0 to {LARGEST_SEED}")
    return number


def flag(name: str, value: Any) -> bool:
    """True or False."""
    if not isinstance(value, bool | np.bool_):
        raise InvalidInput(f"{name}={shown(value)} is {_kind(value)}; give True or False")
    return bool(value)


def text(name: str, value: Any) -> str:
    """A text."""
    if not isinstance(value, str):
        raise InvalidInput(f"{name}={shown(value)} is {_kind(value)}; give a text")
    return str(value)


def file_name(name: str, value: Any) -> str:
    """A name that can be part of the name of a file, as those of controllers and scenarios are."""
    word = text(name, value)
    if not _NAME.fullmatch(word) or len(word) > _LONGEST_NAME:
        raise InvalidInput(
            f"{name}={shown(word)} cannot be part of the name of a file; give 1 to {_LONGEST_NAME} "
            "letters, digits and + - _ . =, with a letter or a digit first"
        )
    return word


def path(name: str, value: Any) -> Path:
    """The path of a file or folder, from a path or a text that is not empty."""
    if not isinstance(value, str | Path) or value == "" or "\0" in str(value):
        raise InvalidInput(f"{name}={shown(value)} is no path; give a text or a pathlib.Path")
    return Path(value)


def instance_of(name: str, value: Any, kind: type[T], wanted: str = "") -> T:
    """An object of a class; `wanted` as in "a Robot, as load_robot() returns it"."""
    if not isinstance(value, kind):
        what = wanted or _with_article(kind.__name__)
        raise InvalidInput(f"{name}={shown(value)} is {_kind(value)}; give {what}")
    return value


def sequence_of(
    name: str,
    values: Any,
    each: Callable[[str, Any], T],
    *,
    length: int | None = None,
    wanted: str = "a sequence",
) -> tuple[T, ...]:
    """A tuple from any sequence or one-dimensional array; a text is none.

    Args:
        name: Name of the parameter.
        values: What was given.
        each: Checks one value, by its name and itself.
        length: How many there have to be; any number by default.
        wanted: What to give, as in "speeds [m/s]".
    """
    count = "" if length is None else f", {length} of them"
    if isinstance(values, str | bytes | Mapping) or not isinstance(values, Iterable):
        raise InvalidInput(
            f"{name}={shown(values)} is {_kind(values)}; give {wanted}{count} in a tuple or a list"
        )
    try:
        items = list(values)
    except TypeError:  # an array without dimensions
        items = None
    if items is None or (length is not None and len(items) != length):
        has = "" if items is None else f" has {len(items)} values"
        raise InvalidInput(f"{name}={shown(values)}{has}; give {wanted}{count}")
    return tuple(each(f"{name}[{k}]", item) for k, item in enumerate(items))


def reals(
    name: str, values: Any, within: Interval = ANY, *, length: int | None = None
) -> tuple[float, ...]:
    """A tuple of finite numbers within an interval: see `sequence_of`."""
    return sequence_of(
        name, values, lambda k, value: real(k, value, within), length=length, wanted="numbers"
    )


def numbers(**arrays: npt.ArrayLike) -> list[npt.NDArray[np.float64]]:
    """Float64 arrays of any shape, by name; texts and truth values are no numbers."""
    found = []
    for name, value in arrays.items():
        try:
            array = np.asarray(value)
            if array.dtype.kind not in "iuf":
                raise TypeError(f"it holds {array.dtype.name.rstrip('0123456789')} values")
            found.append(np.asarray(array, dtype=np.float64))
        except (TypeError, ValueError) as error:
            raise InvalidInput(
                f"{name} is not an array of numbers ({error}); pass floats"
            ) from error
    return found


def none_or(check: Callable[..., T], name: str, value: Any, *others: Any) -> T | None:
    """None, or what a check makes of the value."""
    return None if value is None else check(name, value, *others)


def keep_reals(owner: object, intervals: Mapping[str, Interval], prefix: str = "") -> None:
    """Check attributes of a frozen dataclass that are numbers, and keep them as floats."""
    for name, within in intervals.items():
        object.__setattr__(owner, name, real(prefix + name, getattr(owner, name), within))


def keep_vectors(
    owner: object, intervals: Mapping[str, Interval], length: int | None = 3, prefix: str = ""
) -> None:
    """Check attributes of a frozen dataclass that are so many numbers, and keep them as tuples."""
    for name, within in intervals.items():
        values = reals(prefix + name, getattr(owner, name), within, length=length)
        object.__setattr__(owner, name, values)


def keep_instances(owner: object, prefix: str = "", **kinds: type) -> None:
    """Check attributes of a dataclass that are objects of a class."""
    for name, kind in kinds.items():
        instance_of(prefix + name, getattr(owner, name), kind)


def known_name(kind: str, name: Any, known: Collection[str]) -> str:
    """The name itself, if it is known; else `UnknownName`."""
    if not isinstance(name, str):
        raise InvalidInput(
            f"{kind} {shown(name)} is {_kind(name)}; give a name, one of: {', '.join(known)}"
        )
    if name not in known:
        raise UnknownName(kind, name, known)
    return name


def _number(value: Any) -> float | None:
    """A real number as a float; None for anything else, a bool and a text included."""
    if isinstance(value, bool | np.bool_):
        return None
    if isinstance(value, np.ndarray) and value.shape == () and value.dtype.kind in "iuf":
        value = value.item()
    if not isinstance(value, Real):
        return None
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _kind(value: object) -> str:
    """What something is, in a word or two."""
    if value is None:
        return "nothing"
    return _with_article(type(value).__name__)


def _with_article(name: str) -> str:
    return f"{'an' if name[0].lower() in 'aeiou' else 'a'} {name}"


def _give(what: str, within: Interval) -> str:
    if within.above and within.low == 0.0 and math.isinf(within.high):
        return f"give a positive {what}" + (f" [{within.unit}]" if within.unit else "")
    words = str(within)
    return f"give a {what} {words}" if words else f"give a {what} that is finite"


def worker_count(workers: int | None) -> int:
    """Number of worker processes, no more than any machine has; None for one for each core."""
    return none_or(whole, "workers", workers, Interval(1, 1024)) or os.cpu_count() or 1
