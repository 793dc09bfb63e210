"""Writing of files, whole or not at all."""

from __future__ import annotations

import contextlib
import itertools
import os
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ..errors import FileProblem, cannot_write

_PARTIAL = re.compile(r"\..+\.(\d+)-\d+\.partial(\.\w+)?")
_counter = itertools.count()


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
