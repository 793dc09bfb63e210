"""Files are whole and their own, or refused by name."""

from __future__ import annotations

import io
import json
import os
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from pronk_pin import storage
from pronk_pin.errors import FileProblem


def test_a_file_that_cannot_be_completed_leaves_the_old_one_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = storage.write_file(tmp_path / "report.html", "old")

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(FileProblem, match=r"No space left on device.*make room"):
        storage.write_file(path, "new")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_an_interrupted_write_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(descriptor: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        storage.write_file(tmp_path / "x", b"")
    assert not list(tmp_path.iterdir())


def test_writers_at_once_have_names_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[str] = []
    replace = Path.replace

    def meet(self: Path, target: Path) -> Path:
        seen.append(self.name)
        if len(seen) == 1:
            storage.write_file(target, "second")  # another writer comes in between
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", meet)
    storage.write_file(tmp_path / "x", "first")
    assert len(set(seen)) == 2
    assert (tmp_path / "x").read_text() == "first"


def test_files_are_as_readable_as_any_other_of_the_user(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.write_text("")
    ours = storage.write_file(tmp_path / "ours", "")
    assert ours.stat().st_mode == plain.stat().st_mode


def test_what_a_link_names_is_written_and_the_link_stays(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    storage.write_file(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"


def test_leftovers_are_cleared_away_but_not_those_of_a_process_that_still_writes(
    tmp_path: Path,
) -> None:
    (tmp_path / ".x.999999999-0.partial").touch()
    (tmp_path / "old.nc.partial").touch()
    mine = tmp_path / f".x.{os.getpid()}-0.partial"
    mine.touch()
    storage.clear_partial_files(tmp_path)
    assert list(tmp_path.iterdir()) == [mine]


def test_a_pipe_or_a_folder_is_no_file_and_nothing_waits_for_it(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for name in ("pipe", "."):
        with pytest.raises(FileProblem, match="is not a file; give another"):
            storage.read_bytes(tmp_path / name, "give another")
    with pytest.raises(FileProblem, match="missing; give another"):
        storage.read_bytes(tmp_path / "none", "give another")


@pytest.mark.parametrize(
    "text", ["[" * 100_000, "{", "", '{"a": 1', "\x00", "1" * 10_000, '{"a": nope}']
)
def test_json_that_is_none_is_damage(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.json"
    path.write_text(text)
    with pytest.raises(FileProblem, match="damaged"):
        storage.read_json(path, "make it again")


def _archive(path: Path, header: bytes, data: bytes) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("x.npy", header + data)


def test_an_array_that_promises_more_than_there_is_is_refused_before_memory_is_taken(
    tmp_path: Path,
) -> None:
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        stream, {"descr": "<f8", "fortran_order": False, "shape": (10**12,)}
    )
    _archive(tmp_path / "x.npz", stream.getvalue(), b"\0" * 80)
    with pytest.raises(FileProblem, match=r"damaged library \(x.npy is not of the size"):
        storage.read_arrays(tmp_path / "x.npz", "make it again", what="library")


def test_an_archive_that_unpacks_to_gigabytes_is_refused(tmp_path: Path) -> None:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.zeros(200_000))
    _archive(tmp_path / "x.npz", stream.getvalue(), b"")
    with pytest.raises(FileProblem, match="more than 1 MB when unpacked"):
        storage.read_arrays(tmp_path / "x.npz", "make it again", limit=1_000_000)


def test_arrays_come_back_as_they_were_and_objects_never(tmp_path: Path) -> None:
    path = storage.write_arrays(tmp_path / "x.npz", {"a": np.eye(3), "b": np.array("text")})
    arrays = storage.read_arrays(path, "make it again")
    assert np.array_equal(arrays["a"], np.eye(3))
    assert str(arrays["b"]) == "text"
    np.savez(tmp_path / "objects.npz", a=np.array([{}], dtype=object))
    with pytest.raises(FileProblem, match="damaged"):
        storage.read_arrays(tmp_path / "objects.npz", "make it again")


def test_any_single_bit_of_an_archive_that_flips_is_noticed_or_changes_nothing(
    tmp_path: Path,
) -> None:
    values = np.random.default_rng(0).standard_normal(50)
    whole = storage.write_arrays(tmp_path / "x.npz", {"a": values}).read_bytes()
    rng, noticed = np.random.default_rng(1), 0
    for bit in rng.choice(8 * len(whole), 300, replace=False):
        data = bytearray(whole)
        data[bit // 8] ^= 1 << (bit % 8)
        (tmp_path / "y.npz").write_bytes(data)
        try:
            arrays = storage.read_arrays(tmp_path / "y.npz", "make it again")
        except FileProblem:
            noticed += 1
            continue
        assert "a" not in arrays or np.array_equal(arrays["a"], values)
    assert noticed > 200


@dataclass(frozen=True)
class _Thing:
    name: str
    values: tuple[float, ...]


def test_a_document_becomes_a_dataclass_or_the_fault_is_named() -> None:
    def read(document: object) -> _Thing:
        return storage.as_type(document, _Thing, "x.json", "make it again")

    assert read({"name": "a", "values": [1, 2.5]}) == _Thing("a", (1.0, 2.5))
    for document, fault in [
        ({"name": 1, "values": []}, r"Expected `str`, got `int` - at `\$.name`"),
        ({"name": "a"}, "missing required field `values`"),
        ({"name": "a", "values": [], "more": 1}, "unknown field more"),
        ([], "Expected `object`"),
    ]:
        with pytest.raises(FileProblem, match=fault):
            read(document)


def test_a_fault_of_ours_in_a_dataclass_is_not_called_damage() -> None:
    @dataclass
    class Faulty:
        name: str

        def __post_init__(self) -> None:
            self.missing  # type: ignore[attr-defined]  # noqa: B018

    with pytest.raises(AttributeError):
        storage.as_type({"name": "a"}, Faulty, "x.json", "make it again")


def test_a_sealed_document_that_was_changed_is_refused(tmp_path: Path) -> None:
    document = {"schema": 4, "speeds": [0.1, 0.2]}
    path = storage.write_file(tmp_path / "x.json", storage.sealed(document))
    assert storage.read_sealed(path, "make it again") == document
    changed = {**json.loads(path.read_text()), "speeds": [0.1, 0.3]}
    path.write_text(json.dumps(changed))
    with pytest.raises(FileProblem, match="changed after it was written"):
        storage.read_sealed(path, "make it again")


def test_torn_csv_lines_are_damage(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("a,b\n1,2\n")
    assert storage.read_csv(path, "make it again") == [["a", "b"], ["1", "2"]]
    for text in ("a,b\n1", "", 'a,b\n"1,2\n'):
        path.write_text(text)
        with pytest.raises(FileProblem, match="damaged"):
            storage.read_csv(path, "make it again")
