"""Files, written whole or not at all, and read with one error for every way of being damaged.

Whatever the package writes goes through `write_file`, and whatever it reads through the readers
here. A file appears under its name only when it is whole and on the disk; until then it is a
neighbour that ends in `.partial` and bears the number of the process that writes it.

The readers are around calls of libraries only, so that what they turn into a `FileProblem` is never
a fault of this package. What the contents mean is checked by `as_type`, or by who asked for them.
"""

from __future__ import annotations

import contextlib
import csv
import functools
import hashlib
import io
import itertools
import json
import math
import os
import re
import stat
import tempfile
import xml.etree.ElementTree as ElementTree
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import msgspec.inspect
import numpy as np
import numpy.typing as npt

from ._typing import Array
from .errors import FileProblem, InvalidInput, PronkError, cannot_write

LARGEST_FILE = 2**30
"""Size beyond which no file of ours is read [bytes]; a comparison makes some of 3 % of it."""

LARGEST_ARRAYS = 2**28
"""Size beyond which the arrays of an `.npz` are not unpacked [bytes]."""

LARGEST_DOCUMENT = 2**24
"""Size beyond which no XML is read [bytes]; robots have a hundred kilobytes."""

REINSTALL = "it comes with the package: install that again"
"""The remedy for files that nobody but an installer writes."""

_DEEPEST = 200
"""Elements within elements beyond which no XML is read: libraries in C follow them by recursion."""

_PARTIAL = re.compile(r"\..+\.(\d+)-\d+\.partial(\.\w+)?")
_counter = itertools.count()

_T = TypeVar("_T")


def write_file(
    path: Path | str,
    contents: bytes | str,
    *,
    remedy: str = "choose another place, or make room",
) -> Path:
    """Write a file whole or not at all; what was there before stays until the new one is complete.

    Args:
        path: The file; folders on the way are made. What a link names is written, not the link,
            and what is no regular file (`/dev/stdout`, a pipe) is written to as it stands.
        contents: Text, stored as UTF-8, or bytes.
        remedy: What to do where it cannot be written.

    Returns:
        The path.

    Raises:
        FileProblem: It cannot be written.
    """
    path = Path(path)
    data = contents.encode() if isinstance(contents, str) else contents
    try:
        target = Path(os.path.realpath(path))
        if target.exists() and not target.is_file() and not target.is_dir():
            with target.open("wb") as stream:
                stream.write(data)
            return path
        target.parent.mkdir(parents=True, exist_ok=True)
        _replace(target, data)
    except (OSError, ValueError) as error:
        raise cannot_write(path, error, remedy) from error
    return path


def _replace(target: Path, data: bytes) -> None:
    with _neighbour(target) as partial, partial.open("xb") as stream:
        stream.write(data)
        stream.flush()


@contextlib.contextmanager
def _neighbour(target: Path, suffix: str = "") -> Iterator[Path]:
    """A name beside a file, which takes the file's place at the end, or is gone."""
    partial = target.with_name(f".{target.name}.{os.getpid()}-{next(_counter)}.partial{suffix}")
    try:
        yield partial
        handle = os.open(partial, os.O_RDONLY)
        try:
            os.fsync(handle)  # a name must not outlive a power cut without its contents
        finally:
            os.close(handle)
        partial.replace(target)
    except BaseException:
        with contextlib.suppress(OSError):
            partial.unlink()
        raise


@contextlib.contextmanager
def partial_path(
    path: Path | str, *, remedy: str = "choose another place, or make room"
) -> Iterator[Path]:
    """A name for libraries that write by name: it becomes the file when the block ends well.

    The name has the file's suffix, by which such libraries know what to write.

    Args:
        path: The file; folders on the way are made.
        remedy: What to do where it cannot be written.

    Raises:
        FileProblem: It cannot be written.
    """
    path = Path(path)
    try:
        target = Path(os.path.realpath(path))
        target.parent.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise cannot_write(path, error, remedy) from error
    try:
        with _neighbour(target, target.suffix) as partial:
            yield partial
    except OSError as error:
        raise cannot_write(path, error, remedy) from error


@contextlib.contextmanager
def temporary_folder() -> Iterator[Path]:
    """A folder for temporary files, which is gone at the end of the block.

    Raises:
        FileProblem: It cannot be made.
    """
    try:
        folder = tempfile.TemporaryDirectory(prefix="pronk-pin-", ignore_cleanup_errors=True)
    except OSError as error:
        place = tempfile.tempdir or os.environ.get("TMPDIR", "/tmp")
        remedy = "make room for temporary files, or set TMPDIR"
        raise cannot_write(place, error, remedy) from error
    with folder as name:
        yield Path(name)


def clear_partial_files(folder: Path) -> None:
    """Remove what killed processes have left half written in a folder and the folders in it.

    Raises:
        FileProblem: One cannot be removed.
    """
    names = ("*.partial", ".*.partial.*")
    for partial in [path for name in names for at in ("", "*/") for path in folder.glob(at + name)]:
        writer = _PARTIAL.fullmatch(partial.name)
        if writer is not None and _is_running(int(writer[1])):
            continue
        try:
            partial.unlink(missing_ok=True)
        except OSError as error:
            raise FileProblem(
                partial,
                f"cannot be removed ({error.strerror})",
                "make the folder writable, or choose another one",
            ) from error


def _is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


@contextlib.contextmanager
def reading(path: Path | str, remedy: str, *, what: str = "") -> Iterator[None]:
    """Around calls of a library that reads a file: whatever goes wrong there, the file is damaged.

    Only such calls belong inside, and none of this package's own code, whose faults must be seen.

    Args:
        path: The file, as the error names it.
        remedy: What to do about it.
        what: What the file should be, as in "gait library".

    Raises:
        FileProblem: The library has failed.
    """
    try:
        yield
    except PronkError:
        raise
    except (Exception, MemoryError, RecursionError) as error:
        raise damaged(path, error, remedy, what=what) from error


def damaged(
    path: Path | str, reason: Exception | str, remedy: str, *, what: str = ""
) -> FileProblem:
    """The `FileProblem` of a file whose contents are not what they should be."""
    text = " ".join(str(reason).split()) or type(reason).__name__
    text = text if len(text) <= 200 else f"{text[:197]}..."
    return FileProblem(path, f"damaged{f' {what}' if what else ''} ({text})", remedy)


def read_bytes(path: Path | str, remedy: str, *, limit: int = LARGEST_FILE) -> bytes:
    """Read a regular file.

    Args:
        path: The file.
        remedy: What to do where it is missing or too large.
        limit: Largest size [bytes].

    Raises:
        FileProblem: It is missing, no regular file, too large, or the system cannot read it.
    """
    path = Path(path)
    check_file(path, remedy, limit=limit)
    try:
        return path.read_bytes()
    except (OSError, ValueError) as error:
        raise _unreadable(path, error, remedy) from error


def check_file(path: Path, remedy: str, *, limit: int = LARGEST_FILE) -> None:
    """Refuse what is no regular file, before a library waits for it.

    Args:
        path: The file.
        remedy: What to do where it is missing or too large.
        limit: Largest size [bytes].

    Raises:
        FileProblem: It is missing, no regular file, or too large.
    """
    try:
        status = path.stat()
    except (OSError, ValueError) as error:
        raise _unreadable(path, error, remedy) from error
    if not stat.S_ISREG(status.st_mode):
        raise FileProblem(path, "is not a file", remedy)
    if status.st_size > limit:
        raise FileProblem(path, f"is too large ({status.st_size / 1e6:.0f} MB)", remedy)


def _unreadable(path: Path, error: Exception, remedy: str) -> FileProblem:
    if isinstance(error, FileNotFoundError):
        return FileProblem(path, "missing", remedy)
    reason = getattr(error, "strerror", None) or error
    return FileProblem(path, f"cannot be read ({reason})", remedy)


def read_text(path: Path | str, remedy: str, *, limit: int = LARGEST_FILE) -> str:
    """Read a file of UTF-8 text.

    Raises:
        FileProblem: It cannot be read, or is no text.
    """
    data = read_bytes(path, remedy, limit=limit)
    with reading(path, remedy):
        return data.decode()


def read_json(path: Path | str, remedy: str) -> Any:
    """Read a JSON document.

    Raises:
        FileProblem: It cannot be read, or is no JSON.
    """
    text = read_text(path, remedy)
    with reading(path, remedy):
        return json.loads(text)


def read_xml(path: Path | str, remedy: str, *, what: str = "") -> ElementTree.Element:
    """Read an XML document; the root of its tree.

    Raises:
        FileProblem: It cannot be read, or is no XML.
    """
    return parse_xml(read_bytes(path, remedy, limit=LARGEST_DOCUMENT), path, remedy, what=what)


def parse_xml(data: bytes, path: Path | str, remedy: str, *, what: str = "") -> ElementTree.Element:
    """The root of the tree of an XML document that was read from a file.

    Raises:
        FileProblem: It is no XML, or is nested too deeply, or declares a document type, by which
            a short document may become a long one.
    """
    with reading(path, remedy, what=what):
        parser = ElementTree.XMLParser(target=_Builder())
        parser.feed(data)
        root: ElementTree.Element = parser.close()
        return root


def refuse_nan(root: ElementTree.Element, path: Path, remedy: str, *, what: str = "") -> None:
    """Refuse a description of a robot in which a number is none.

    Raises:
        FileProblem: An attribute that is no name has NaN in it.
    """
    for element in root.iter():
        for key, text in element.items():
            if key not in ("name", "class", "link") and "nan" in text.lower().split():
                raise damaged(path, f'<{element.tag} {key}="{text}">', remedy, what=what)


class _Builder(ElementTree.TreeBuilder):
    """Builds trees that are not too deep."""

    _depth = 0

    def start(self, tag: str, attrs: dict[str, str], /) -> ElementTree.Element:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise ValueError(f"more than {_DEEPEST} elements within one another")
        return super().start(tag, attrs)

    def end(self, tag: str, /) -> ElementTree.Element:
        self._depth -= 1
        return super().end(tag)

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise ValueError("it declares a document type")


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
        if seal != _arrays_sha256(self):
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
    stored["sha256"] = np.array(_arrays_sha256(stored))
    stream = io.BytesIO()
    np.savez_compressed(stream, **stored)  # type: ignore[arg-type]
    return write_file(path, stream.getvalue(), remedy=remedy)


def _arrays_sha256(arrays: Mapping[str, npt.NDArray[Any]]) -> str:
    """SHA-256 of arrays with their names, types and shapes."""
    digest = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        digest.update(json.dumps([name, array.dtype.str, array.shape]).encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def read_csv(path: Path | str, remedy: str) -> list[list[str]]:
    """Read the rows of a CSV file as text, the heading first.

    Raises:
        FileProblem: It cannot be read, is empty, or its rows are not of one length.
    """
    text = read_text(path, remedy)
    with reading(path, remedy):
        rows = list(csv.reader(io.StringIO(text), strict=True))
    if not rows or {len(row) for row in rows} != {len(rows[0])}:
        raise damaged(path, "rows of different lengths" if rows else "empty", remedy)
    return rows


def as_type(
    document: object, kind: type[_T], path: Path | str, remedy: str, *, what: str = ""
) -> _T:
    """What a JSON document says, as a dataclass or another type.

    Args:
        document: Lists, dictionaries, strings, numbers, as `read_json` gives them.
        kind: The type; unknown fields of a dataclass are refused.
        path: Where the document comes from, for the error.
        remedy: What to do where it is something else.
        what: What the file should be.

    Raises:
        FileProblem: It is something else.
        PronkError: What the dataclass itself raises for values that are out of range.
    """
    try:
        unknown_fields(document, kind)
        return msgspec.convert(document, kind)
    except (msgspec.ValidationError, RecursionError) as error:
        raise damaged(path, error, remedy, what=what) from error


def from_text(text: str, kind: type[_T], what: str, remedy: str) -> _T:
    """What JSON says that one of our own dataclasses was written to with everything in it.

    Args:
        text: The text.
        kind: The dataclass; a field too few is refused as one too many.
        what: What the text should be, as in "a scenario".
        remedy: How to come by it, as in "make the strides again".

    Raises:
        InvalidInput: The text is something else.
        PronkError: What the dataclass itself raises for values that are out of range.
    """
    try:
        document = json.loads(text)
        unknown_fields(document, kind, complete=True)
        return msgspec.convert(document, kind)
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"this is not {what} ({error}); {remedy}") from error


def unknown_fields(document: object, kind: Any, *, complete: bool = False) -> None:
    """Refuse fields that a dataclass, or one within it, does not have.

    Args:
        document: Lists, dictionaries, strings, numbers.
        kind: The dataclass, or another type.
        complete: Refuse missing fields too, even those that have a default.
    """
    _compare_fields(document, _type_info(kind), complete)


@functools.lru_cache(maxsize=64)
def _type_info(kind: Any) -> msgspec.inspect.Type:
    return msgspec.inspect.type_info(kind)


def _compare_fields(document: object, info: msgspec.inspect.Type, complete: bool) -> None:
    inspect = msgspec.inspect
    if isinstance(info, inspect.UnionType):
        structured = [part for part in info.types if not isinstance(part, inspect.NoneType)]
        if len(structured) == 1:
            _compare_fields(document, structured[0], complete)
    elif isinstance(info, inspect.DataclassType) and isinstance(document, dict):
        fields = {field.name: field.type for field in info.fields}
        for strangers, word in [
            (document.keys() - fields.keys(), "unknown"),
            (fields.keys() - document.keys() if complete else set(), "missing"),
        ]:
            if strangers:
                listed = ", ".join(sorted(map(str, strangers)))
                raise msgspec.ValidationError(f"{word} field {listed}")
        for name, part in document.items():
            _compare_fields(part, fields[name], complete)
    elif isinstance(info, inspect.ListType | inspect.VarTupleType) and isinstance(document, list):
        for part in document:
            _compare_fields(part, info.item_type, complete)
    elif isinstance(info, inspect.DictType) and isinstance(document, dict):
        for part in document.values():
            _compare_fields(part, info.value_type, complete)


def sha256(data: bytes | str) -> str:
    """SHA-256 of bytes, or of text as UTF-8, in hexadecimal digits."""
    return hashlib.sha256(data.encode() if isinstance(data, str) else data).hexdigest()


def sealed(document: Mapping[str, Any]) -> str:
    """A JSON document as text, with the SHA-256 of what it says in its last field, `sha256`."""
    body = {key: value for key, value in document.items() if key != "sha256"}
    return json.dumps({**body, "sha256": sha256(_canonical(body))}, indent=2) + "\n"


def read_sealed(path: Path | str, remedy: str) -> dict[str, Any]:
    """Read a JSON document that `sealed` made, without its seal.

    Raises:
        FileProblem: It cannot be read, or says something else than when it was sealed.
    """
    document = read_json(path, remedy)
    if not isinstance(document, dict) or "sha256" not in document:
        raise damaged(path, "it has no 'sha256'", remedy)
    seal = document.pop("sha256")
    if seal != sha256(_canonical(document)):
        raise damaged(path, "it was changed after it was written", remedy)
    return document


def _canonical(document: object) -> str:
    return json.dumps(document, sort_keys=True, separators=(",", ":"))
