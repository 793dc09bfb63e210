"""Reading of files, with one error for every way of being damaged."""

from __future__ import annotations

import contextlib
import csv
import io
import stat
from collections.abc import Iterator
from pathlib import Path

from ..errors import FileProblem, PronkError

LARGEST_FILE = 2**30
"""Size beyond which no file of ours is read [bytes]; a comparison makes some of 3 % of it."""

REINSTALL = "it comes with the package: install that again"
"""The remedy for files that nobody but an installer writes."""


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
