"""Files are whole and their own, or refused by name."""

from __future__ import annotations

import io
import json
import os
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from pronk_pin import storage
from pronk_pin.errors import FileProblem, InvalidInput


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


def test_a_library_that_writes_by_name_makes_the_whole_file_or_none(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "film.mp4"
    with storage.partial_path(path) as partial:
        assert partial.parent == path.parent
        assert partial.suffix == ".mp4"
        partial.write_text("film")
        assert not path.exists()
    assert path.read_text() == "film"
    with pytest.raises(FileProblem, match=r"film.mp4: cannot be written \(No space"):
        _write_half(path)
    assert path.read_text() == "film"
    assert list(path.parent.iterdir()) == [path]


def _write_half(path: Path) -> None:
    with storage.partial_path(path) as partial:
        partial.write_text("half")
        raise OSError(28, "No space left on device")


def test_a_library_that_wrote_nothing_is_told(tmp_path: Path) -> None:
    with (
        pytest.raises(FileProblem, match=r"x.mp4: cannot be written"),
        storage.partial_path(tmp_path / "x.mp4"),
    ):
        pass


def test_a_fault_of_ours_while_a_library_writes_is_not_called_a_full_disk(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="ours"), storage.partial_path(tmp_path / "x.mp4"):
        raise ValueError("ours")
    assert not list(tmp_path.iterdir())


def test_leftovers_with_a_suffix_are_cleared_away_too(tmp_path: Path) -> None:
    (tmp_path / ".x.mp4.999999999-0.partial.mp4").touch()
    mine = tmp_path / f".x.mp4.{os.getpid()}-0.partial.mp4"
    mine.touch()
    storage.clear_partial_files(tmp_path)
    assert list(tmp_path.iterdir()) == [mine]


def test_arrays_that_were_changed_or_are_of_another_schema_are_refused(tmp_path: Path) -> None:
    path = storage.write_arrays(tmp_path / "x.npz", {"a": np.eye(3)}, schema=3)
    assert np.array_equal(storage.read_arrays(path, "again", schema=3)["a"], np.eye(3))
    with pytest.raises(FileProblem, match="schema 3, not 4; again"):
        storage.read_arrays(path, "again", schema=4)
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    for change in (
        {"a": np.eye(3) + 1e-16},
        {"a": np.eye(3).astype(np.float32)},
        {"a": np.eye(3).reshape(9)},
        {"b": np.eye(3)},
    ):
        np.savez(path, **(arrays | change))
        with pytest.raises(FileProblem, match="changed after it was written"):
            storage.read_arrays(path, "again", schema=3)
    np.savez(path, a=np.eye(3), schema=np.array(3))
    with pytest.raises(FileProblem, match="it has no 'sha256'"):
        storage.read_arrays(path, "again", schema=3)


def test_stored_arrays_say_what_is_wrong_with_them() -> None:
    arrays = storage.StoredArrays(
        {"a": np.zeros((2, 3)), "b": np.array([np.inf]), "c": np.array("{}"), "d": np.array(["x"])},
        "x.npz",
        "again",
        "library",
    )
    assert arrays.numbers("a", 2, None).shape == (2, 3)
    assert arrays.document("c") == {}
    assert arrays.texts("d") == ["x"]
    for ask, problem in [
        (lambda: arrays.numbers("z"), "it has no 'z'"),
        (lambda: arrays.numbers("a", 3, None), r"a has the shape \(2, 3\), not \(3, n\)"),
        (lambda: arrays.numbers("a", 2), r"a has the shape \(2, 3\), not \(2\)"),
        (lambda: arrays.numbers("b", None), "b is not finite"),
        (lambda: arrays.numbers("c"), "c is .*, not numbers"),
        (lambda: arrays.text("d"), "d has the shape"),
        (lambda: arrays.texts("c"), "c has the shape"),
        (lambda: arrays.document("a"), "a is float64, not text"),
    ]:
        with pytest.raises(FileProblem, match=f"x.npz: damaged library \\({problem}.*; again"):
            ask()


@dataclass(frozen=True)
class _Box:
    things: tuple[_Thing, ...]
    best: _Thing | None = None
    size: float = 1.0


def test_text_that_we_wrote_has_every_field_at_every_depth_or_is_refused() -> None:
    thing = {"name": "a", "values": [1.0]}

    def read(document: object) -> _Box:
        return storage.from_text(json.dumps(document), _Box, "a box", "pack it again")

    whole = {"things": [thing], "best": thing, "size": 2.0}
    assert read(whole) == _Box((_Thing("a", (1.0,)),), _Thing("a", (1.0,)), 2.0)
    for document, fault in [
        ({**whole, "things": [{**thing, "more": 1}]}, "unknown field more"),
        ({**whole, "best": {**thing, "more": 1}}, "unknown field more"),
        ({"things": [], "size": 1.0}, "missing field best"),
        ({**whole, "size": "large"}, "Expected `float`"),
        ("[" * 9, "Expected `object`"),
    ]:
        with pytest.raises(InvalidInput, match=f"this is not a box .*{fault}.*; pack it again"):
            read(document)


@pytest.mark.parametrize(
    "text",
    [
        "<a>" * 300 + "</a>" * 300,
        '<!DOCTYPE a [<!ENTITY x "y">]><a>&x;</a>',
        "<a>",
        "",
        "<a b=1/>",
        "\ud800",
    ],
)
def test_xml_that_is_none_or_bottomless_is_damage(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.xml"
    path.write_bytes(text.encode(errors="surrogatepass"))
    with pytest.raises(FileProblem, match="damaged robot"):
        storage.read_xml(path, "again", what="robot")


def test_xml_of_100_mb_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "x.xml").open("wb") as stream:
        stream.truncate(100_000_000)
    with pytest.raises(FileProblem, match=r"is too large \(100 MB\)"):
        storage.read_xml(tmp_path / "x.xml", "again")


def test_a_temporary_folder_is_gone_at_the_end_and_its_absence_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with storage.temporary_folder() as folder:
        (folder / "x").write_text("")
    assert not list(tmp_path.iterdir())
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    with (
        pytest.raises(FileProblem, match=r"none: cannot be written .*; .*set TMPDIR"),
        storage.temporary_folder(),
    ):
        pass


def test_folders_that_are_missing_are_made_with_those_above_them(tmp_path: Path) -> None:
    path = tmp_path / "some" / "new" / "folder" / "file.txt"
    for text in ("first", "second"):  # the second time they are there
        assert storage.write_file(path, text, remedy="choose another") == path
        assert path.read_text() == text
    assert list(path.parent.iterdir()) == [path]  # and nothing partial stays behind
