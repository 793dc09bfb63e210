"""Documents with arrays as one compressed blob, for the page.

A blob is zlib-compressed: the length of a JSON text (4 bytes, little-endian), the text, and the
bytes of the arrays. In the JSON an array is an object `{"$": kind, "at": offset, "shape": [...]}`:

- `"u4"`: 32-bit unsigned integers, one after the other;
- `"f2"`: numbers rounded to 65,535 steps between each column's least and greatest (`"low"`,
  `"step"`), as differences from the row before, column by column, all low bytes before all high
  ones: motions are smooth, so that this halves what the compression leaves. The step 65,535 stands
  for NaN.
"""

from __future__ import annotations

import json
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

_STEPS = 65534
_NAN = 65535


def pack(document: Any) -> bytes:
    """A document of dicts, lists, strings, numbers and arrays (n, ...) as a blob."""
    chunks: list[bytes] = []
    text = json.dumps(_lowered(document, chunks), separators=(",", ":")).encode()
    return zlib.compress(len(text).to_bytes(4, "little") + text + b"".join(chunks), 9)


def _lowered(value: Any, chunks: list[bytes]) -> Any:
    if isinstance(value, dict):
        return {key: _lowered(entry, chunks) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_lowered(entry, chunks) for entry in value]
    if isinstance(value, np.ndarray):
        entry = {"at": sum(map(len, chunks)), "shape": list(value.shape)}
        if value.dtype.kind in "iu":
            chunks.append(value.astype("<u4").tobytes())
            return {"$": "u4", **entry}
        low, step, data = _rounded(value.reshape(len(value), -1))
        chunks.append(data)
        return {"$": "f2", **entry, "low": low, "step": step}
    return value


def _rounded(table: npt.NDArray[Any]) -> tuple[list[float], list[float], bytes]:
    """Least values and steps of the columns of a table, and its rounded differences."""
    finite = np.isfinite(table)
    least = np.min(np.where(finite, table, np.inf), axis=0, initial=np.inf)
    greatest = np.max(np.where(finite, table, -np.inf), axis=0, initial=-np.inf)
    empty = ~np.isfinite(least)
    least[empty], greatest[empty] = 0.0, 0.0
    step = (greatest - least) / _STEPS
    scaled = np.divide(table - least, step, out=np.zeros_like(table), where=finite & (step > 0.0))
    whole = np.where(finite, np.rint(scaled), _NAN).astype("<u2")
    differences = np.diff(whole, axis=0, prepend=np.zeros((1, whole.shape[1]), "<u2"))  # mod 2^16
    columns = differences.astype("<u2").T.ravel()
    data = columns.astype("u1").tobytes() + (columns >> 8).astype("u1").tobytes()
    return least.tolist(), step.tolist(), data
