"""Arrays in `.npz` files: checked before they are unpacked, and sealed."""

from __future__ import annotations

import hashlib
import io
import json
import math
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .._typing import Array
from ..errors import FileProblem
from .documents import _T, as_type
from .reading import damaged, read_bytes, reading
from .writing import write_file

LARGEST_ARRAYS = 2**28
"""Size beyond which the arrays of an `.npz` are not unpacked [bytes]."""


class StoredArrays(dict[str, npt.NDArray[Any]]):
    """The arrays of an `.npz` by name, which are asked for with what they have to be.

    Attributes:
        path: The file.
        remedy: What to do where they are something else.
        what: What the file should be.
    """

    def __init__(
        self, arrays: Mapping[str, npt.NDArray[Any]], path: Path | str, remedy: str, what: str = ""
    ) -> None:
        super().__init__(arrays)
        self.path, self.remedy, self.what = Path(path), remedy, what

    def damaged(self, reason: Exception | str) -> FileProblem:
        """The `FileProblem` of contents that are not what they should be."""
        return damaged(self.path, reason, self.remedy, what=self.what)

    def numbers(self, name: str, *shape: int | None) -> Array:
        """An array of finite numbers of a given shape, where None stands for any length.

        Raises:
            FileProblem: It is missing or something else.
        """
        found = self._array(name, "fiu", "numbers")
        fits = len(found.shape) == len(shape) and all(
            wanted in (None, size) for wanted, size in zip(shape, found.shape, strict=True)
        )
        if not fits:
            listed = ", ".join("n" if size is None else str(size) for size in shape)
            raise self.damaged(f"{name} has the shape {found.shape}, not ({listed})")
        if not np.all(np.isfinite(found)):
            raise self.damaged(f"{name} is not finite")
        return np.asarray(found, dtype=np.float64)

    def texts(self, name: str) -> list[str]:
        """An array of texts, shape (n,).

        Raises:
            FileProblem: It is missing or something else.
        """
        found = self._array(name, "U", "text")
        if found.ndim != 1:
            raise self.damaged(f"{name} has the shape {found.shape}, not (n)")
        return [str(text) for text in found]

    def text(self, name: str) -> str:
        """A text.

        Raises:
            FileProblem: It is missing or something else.
        """
        found = self._array(name, "U", "text")
        if found.ndim:
            raise self.damaged(f"{name} has the shape {found.shape}, not ()")
        return str(found)

    def document(self, name: str) -> Any:
        """A JSON document that is stored as text.

        Raises:
            FileProblem: It is missing, or no JSON.
        """
        text = self.text(name)
        with reading(self.path, self.remedy, what=self.what):
            return json.loads(text)

    def as_type(self, document: object, kind: type[_T]) -> _T:
        """What such a document says, as a dataclass or another type.

        Raises:
            FileProblem: It is something else.
        """
        return as_type(document, kind, self.path, self.remedy, what=self.what)

    def check(self, schema: int | None) -> None:
        """Check the schema and the seal that `write_arrays` has added, and take out the seal.

        Raises:
            FileProblem: Another schema, or something else than when it was written.
        """
        if schema is not None:
            found = self.numbers("schema")
            if found != schema:
                raise FileProblem(self.path, f"schema {found:g}, not {schema}", self.remedy)
        if "sha256" not in self:
            raise self.damaged("it has no 'sha256'")
        seal = self.text("sha256")
        del self["sha256"]
        if seal != arrays_sha256(self):
            raise self.damaged("it was changed after it was written")

    def _array(self, name: str, kinds: str, what: str) -> npt.NDArray[Any]:
        if name not in self:
            raise self.damaged(f"it has no '{name}'")
        if self[name].dtype.kind not in kinds:
            raise self.damaged(f"{name} is {self[name].dtype.name}, not {what}")
        return self[name]


def read_arrays(
    path: Path | str,
    remedy: str,
    *,
    what: str = "",
    schema: int | None = None,
    limit: int = LARGEST_ARRAYS,
) -> StoredArrays:
    """Read an `.npz` that `write_arrays` made, after a look at how large it says it is.

    Args:
        path: The file.
        remedy: What to do where it cannot be read.
        what: What the file should be.
        schema: The version of its format that it was written with; None for none.
        limit: Largest size of all arrays together [bytes].

    Raises:
        FileProblem: It is missing, damaged, changed, of another schema or too large, or holds
            objects, which are never read.
    """
    data = read_bytes(path, remedy)
    with reading(path, remedy, what=what), zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = archive.infolist()
        if sum(member.file_size for member in members) > limit:
            raise ValueError(f"more than {limit / 1e6:.0f} MB when unpacked")
        arrays = {
            member.filename.removesuffix(".npy"): _array(archive, member) for member in members
        }
    stored = StoredArrays(arrays, path, remedy, what)
    stored.check(schema)
    return stored


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> npt.NDArray[Any]:
    """An array of an archive, whose header must not promise more than there is."""
    stream = io.BytesIO(archive.read(member))
    version = np.lib.format.read_magic(stream)
    if version == (1, 0):
        shape, _, dtype = np.lib.format.read_array_header_1_0(stream)
    else:
        shape, _, dtype = np.lib.format.read_array_header_2_0(stream)
    if math.prod(shape) * dtype.itemsize != member.file_size - stream.tell():
        raise ValueError(f"{member.filename} is not of the size that it says")
    stream.seek(0)
    return np.lib.format.read_array(stream, allow_pickle=False)


def write_arrays(
    path: Path | str,
    arrays: Mapping[str, npt.ArrayLike],
    *,
    schema: int | None = None,
    remedy: str = "choose another place, or make room",
) -> Path:
    """Write an `.npz`, whole or not at all, with the SHA-256 of its arrays as `sha256` in it.

    Args:
        path: The file.
        arrays: The arrays, by name.
        schema: The version of its format; None for none.
        remedy: What to do where it cannot be written.

    Raises:
        FileProblem: It cannot be written.
    """
    stored = {name: np.asarray(array) for name, array in arrays.items()}
    if schema is not None:
        stored = {"schema": np.array(schema), **stored}
    stored["sha256"] = np.array(arrays_sha256(stored))
    stream = io.BytesIO()
    np.savez_compressed(stream, **stored)  # type: ignore[arg-type]
    return write_file(path, stream.getvalue(), remedy=remedy)


def arrays_sha256(arrays: Mapping[str, npt.NDArray[Any]]) -> str:
    """SHA-256 of arrays with their names, types and shapes."""
    digest = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        digest.update(json.dumps([name, array.dtype.str, array.shape]).encode())
        digest.update(array.tobytes())
    return digest.hexdigest()
