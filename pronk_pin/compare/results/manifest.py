"""The manifest of a results folder: the SHA-256 of each file that it vouches for.

An entry is written before its file: a run that is killed in between has announced what is not
there, which is made again, and never a file that nobody vouches for.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path

from ...storage import as_type, damaged, read_bytes, read_sealed, sealed, sha256, write_file
from .remedies import complete, no_room

MANIFEST = "manifest.json"
"""Its name."""


@dataclass(frozen=True)
class _Document:
    """What the file holds."""

    files: dict[str, str] = field(default_factory=dict)
    """SHA-256 by name."""
    made_of: dict[str, str] = field(default_factory=dict)
    """Of a file that is computed from others, SHA-256 of these, by its name."""


@dataclass(frozen=True)
class Manifest:
    """The manifest of a folder, read anew at each question.

    Attributes:
        folder: The folder.
    """

    folder: Path

    def holds(self, name: str) -> bool:
        """Whether a file is there and has an entry."""
        return name in self._read().files and (self.folder / name).is_file()

    def read(self, name: str, remedy: str) -> bytes:
        """Read a file that is the one that was written.

        Raises:
            FileProblem: It is missing, or another one.
        """
        path = self.folder / name
        data = read_bytes(path, remedy)
        if self._read().files.get(name) != sha256(data):
            raise damaged(path, "it is not the file that was written there", remedy)
        return data

    def write(self, name: str, contents: str | bytes, *, made_of: str = "") -> None:
        """Write a file, after its entry.

        Args:
            name: Its name.
            contents: What is in it.
            made_of: `digest` of the files that it is computed from.

        Raises:
            FileProblem: It cannot be written.
        """
        data = contents.encode() if isinstance(contents, str) else contents
        known = self._read()
        known.files[name] = sha256(data)
        if made_of:
            known.made_of[name] = made_of
        for path, text in ((MANIFEST, sealed(_sorted(known))), (name, data)):
            write_file(self.folder / path, text, remedy=no_room(self.folder))

    def made_of(self, name: str) -> str:
        """`digest` of the files that a file was computed from; empty if it is not known."""
        return self._read().made_of.get(name, "")

    def digest(self, names: Iterable[str]) -> str:
        """SHA-256 of several files together, from their entries."""
        files = self._read().files
        return sha256("\n".join(files.get(name, "") for name in sorted(names)))

    def _read(self) -> _Document:
        path = self.folder / MANIFEST
        if not path.exists():
            return _Document()
        remedy = f"delete it and {complete(self.folder)}"
        return as_type(read_sealed(path, remedy), _Document, path, remedy)


def _sorted(document: _Document) -> dict[str, dict[str, str]]:
    return {key: dict(sorted(part.items())) for key, part in asdict(document).items()}
