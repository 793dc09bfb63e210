"""Files that were damaged in any way are refused in one line, or read as they were: never else."""

from __future__ import annotations

import contextlib
import copy
import dataclasses
import hashlib
import io
import json
import os
import shutil
import signal
import xml.etree.ElementTree as ElementTree
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pronk_pin import Robot, RobotSpec, load_robot
from pronk_pin.cli import main
from pronk_pin.compare import Experiment, Results, Schedule, load_scenario, run_experiment
from pronk_pin.compare.experiment.description import describe
from pronk_pin.compare.world.mujoco_world.mjcf import ForeignRobot, mjcf_sha256, mjcf_spec
from pronk_pin.compare.world.scenario import Scenario
from pronk_pin.control import TorqueLibrary
from pronk_pin.errors import FileProblem, PronkError
from pronk_pin.gait import GaitLibrary, build_library
from pronk_pin.gait.build import _read, _Task
from pronk_pin.gait.style import gait_problem
from pronk_pin.parity import compare_models
from pronk_pin.robot.formats.urdf import mujoco_spec
from pronk_pin.robot.robot import _load
from pronk_pin.storage import read_text, write_arrays

PATIENCE = 10.0
"""Time after which a reader counts as hanging [s]."""

Rng = np.random.Generator
Damage = Callable[[bytes, Rng], bytes]
WRONG: tuple[Any, ...] = (
    *(None, True, -1, 0, 3, 1e308, -1e308, 10**400, float("nan"), float("inf"), 0.1),
    *("", "x", "NaN", "\x00", "ü" * 1000, [], {}, [[]], {"a": 1}, [1] * 1000),
)


# Damage to bytes


def flip(data: bytes, rng: Rng) -> bytes:
    found = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        found[int(rng.integers(len(found)))] ^= 1 << int(rng.integers(8))
    return bytes(found)


def cut(data: bytes, rng: Rng) -> bytes:
    return data[: int(rng.integers(len(data)))]


def overwrite(data: bytes, rng: Rng) -> bytes:
    at, size = int(rng.integers(len(data))), int(rng.integers(1, 200))
    filler = rng.bytes(size) if rng.random() < 0.5 else bytes(size)
    return data[:at] + filler[: len(data) - at] + data[at + size :]


def shuffle(data: bytes, rng: Rng) -> bytes:
    a, b = sorted(int(k) for k in rng.integers(len(data), size=2))
    return data[:a] + data[b:] if rng.random() < 0.5 else data[:b] + data[a:]


def replace(data: bytes, rng: Rng) -> bytes:
    others = [
        *(b"", rng.bytes(300), bytes(300), b"\xff\xfe<\x00", b"\xef\xbb\xbf", b"PK\x03\x04"),
        *(b"null", b"[]", b"{}", b"[" * 50_000, b"0", b"a,b\n1\n", b"<robot/>", b"<mujoco/>"),
        *(
            archive({}),
            b"\x89HDF\r\n\x1a\n" + bytes(200),
            data[::-1],
            data.decode("latin-1")[:900].encode("utf-16"),
        ),
    ]
    return others[int(rng.integers(len(others)))]


BYTES: tuple[Damage, ...] = (flip, flip, cut, overwrite, shuffle, replace)


# Damage to documents


def places(document: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The ways to all parts of a document."""
    yield at
    if isinstance(document, dict | list):
        for key in document if isinstance(document, dict) else range(len(document)):
            yield from places(document[key], (*at, key))


def edit_json(data: bytes, rng: Rng) -> bytes:
    document = json.loads(data)
    ways = list(places(document))
    *way, last = ways[int(rng.integers(1, len(ways)))]
    part = document
    for key in way:
        part = part[key]
    what = int(rng.integers(5))
    if what == 0:
        del part[last]
    elif what == 1 and isinstance(part, dict):
        part["stranger"] = 1
    elif what == 2 and isinstance(part[last], int | float):
        part[last] = part[last] * 1.01 + 1
    elif what == 3:
        return json.dumps(document).replace("1", "[" * 5000 + "]" * 5000, 1).encode()
    else:
        part[last] = WRONG[int(rng.integers(len(WRONG)))]
    return json.dumps(document).encode()


def edit_xml(data: bytes, rng: Rng) -> bytes:
    root = ElementTree.fromstring(data)
    elements = list(root.iter())
    element = elements[int(rng.integers(len(elements)))]
    wrong = (
        "NaN",
        "inf",
        "-1",
        "0",
        "1e308",
        "1e-320",
        "",
        "x",
        "1 2",
        "0 " * 999,
        "\u00fc",
        "1e5",
    )
    keys = list(element.attrib)
    what = int(rng.integers(8))
    if what in (0, 1, 2) and keys:
        element.set(keys[int(rng.integers(len(keys)))], wrong[int(rng.integers(len(wrong)))])
    elif what == 3 and keys:
        del element.attrib[keys[int(rng.integers(len(keys)))]]
    elif what == 4:
        element.clear()
    elif what == 5:
        element.append(copy.deepcopy(elements[int(rng.integers(len(elements)))]))
    elif what == 6:
        name = ("include", "replicate", "robot", "joint", "link")[int(rng.integers(5))]
        file = ("fuzz.xml", "/dev/zero", "..", "", "x")[int(rng.integers(5))]
        ElementTree.SubElement(element, name, file=file, count="1000000000", name="x")
    elif what == 7:
        for _ in range(int(rng.integers(1, 300))):
            element = ElementTree.SubElement(element, element.tag, dict(element.attrib))
    text = ElementTree.tostring(root, encoding="unicode")
    if rng.random() < 0.03:
        text = f"<{root.tag}>" + "<a>" * 100_000 + "</a>" * 100_000 + f"</{root.tag}>"
    if rng.random() < 0.03:
        text = f'<!DOCTYPE a [<!ENTITY a "{"x" * 99}"><!ENTITY b "{"&a;" * 99}">]>{text}'
    return text.encode("utf-16" if rng.random() < 0.03 else "utf-8")


# Damage to archives


def archive(members: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in members.items():
            file.writestr(name, data)
    return stream.getvalue()


def member(array: Any) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.asarray(array), allow_pickle=True)
    return stream.getvalue()


def promise(dtype: str, shape: tuple[int, ...]) -> bytes:
    """An array that is not there."""
    stream = io.BytesIO()
    header = {"descr": dtype, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(stream, header)
    return stream.getvalue() + bytes(80)


@lru_cache(maxsize=1)
def bomb() -> bytes:
    return archive({"x.npy": bytes(300_000_000)})


def changed_array(array: Any, rng: Rng) -> bytes:
    others: list[Callable[[], bytes]] = [
        lambda: member(array.ravel()),
        lambda: member(array[None]),
        lambda: member(array[:0] if array.ndim else np.empty(0)),
        lambda: member(array.T if array.ndim > 1 else np.arange(3)),
        lambda: member(np.asarray(array).astype("U3")),
        lambda: member(np.array([{}], dtype=object)),
        lambda: member(np.full(array.shape, np.nan)),
        lambda: member(np.zeros(array.shape, complex)),
        lambda: promise("<f8", (10**12,)),
        lambda: promise("<f8", (-1, -10)),
        lambda: promise("<f8", ()),
        lambda: member(np.nextafter(array, 9.0)) if array.dtype.kind == "f" else member(7),
        lambda: member(np.array("[" * 9999)),
        lambda: member(np.array("{}")),
    ]
    return others[int(rng.integers(len(others)))]()


def edit_arrays(data: bytes, rng: Rng) -> bytes:
    with np.load(io.BytesIO(data)) as file:
        arrays = {name: file[name] for name in file.files}
    members = {f"{name}.npy": member(array) for name, array in arrays.items()}
    name = list(arrays)[int(rng.integers(len(arrays)))]
    what = int(rng.integers(12))
    if what == 0:
        del members[f"{name}.npy"]
    elif what == 1:
        members["stranger.npy"] = member(1.0)
    elif what == 2:
        members[f"{name}x.npy"] = members.pop(f"{name}.npy")
    elif what == 3 and rng.random() < 0.2:
        return bomb()
    else:
        members[f"{name}.npy"] = changed_array(arrays[name], rng)
    return archive(members)


def forge(data: bytes, rng: Rng) -> bytes:
    """Change an array, or a document in it, and seal it all again."""
    with np.load(io.BytesIO(data)) as file:
        arrays = {name: file[name] for name in file.files if name not in ("sha256", "schema")}
        schema = int(file["schema"])
    name = list(arrays)[int(rng.integers(len(arrays)))]
    text = str(arrays[name]) if arrays[name].dtype.kind == "U" and not arrays[name].ndim else ""
    if text[:1] in ("{", "[") and rng.random() < 0.9:
        arrays[name] = np.array(edit_json(text.encode(), rng).decode())
    else:
        with contextlib.suppress(ValueError, MemoryError):  # some are none that could be written
            stream = io.BytesIO(changed_array(arrays[name], rng))
            arrays[name] = np.lib.format.read_array(stream)
    folder = Path(os.environ["PRONK_PIN_FUZZ"])
    return write_arrays(folder / "forged.npz", arrays, schema=schema).read_bytes()


# What is read, and by whom


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Attributes:
        name: Its name.
        file: What the file is called.
        read: Reads it; what comes out tells two contents apart.
        damages: What is done to it.
        input: Whether it is somebody else's to change: another one that is right is not wrong.
    """

    name: str
    file: str
    read: Callable[[Path], object]
    damages: tuple[Damage, ...]
    input: bool = False


def of_library(library: GaitLibrary) -> list[object]:
    audits = [audit.as_json() for audit in library.audit]
    return [library.sha256, json.dumps([dict(library.metadata), audits], sort_keys=True)]


def read_gaits(path: Path) -> object:
    return of_library(GaitLibrary.load(path, audited=False))


def read_gait(path: Path) -> object:
    solved = _read(_Task(gait_problem(load_robot(), 0.0), path))
    state = solved.state
    parts = [part.tobytes() for part in (state.x, state.lam_x, state.lam_g)]
    return [*of_library(solved.library), *parts]


def read_torques(path: Path) -> object:
    library = TorqueLibrary.load(path)
    parts = (library.speeds, library.torque, library.spread, library.flight)
    return [(part.shape, part.tobytes()) for part in parts]


def read_urdf(path: Path) -> object:
    robot = _load.__wrapped__(RobotSpec("fuzz", str(path)))
    model = mujoco_spec(robot).compile()
    assert np.all(np.isfinite(robot.standing))
    links = ElementTree.fromstring(robot.urdf).findall("link")
    masses = [link.find("inertial/mass") for link in links]
    total = sum(float(mass.get("value", "")) for mass in masses if mass is not None)
    assert abs(robot.mass - total) < 1e-9 * total, "a link is left out"
    assert np.all(np.isfinite(model.body_inertia))
    return robot.sha256


def read_mjcf(path: Path) -> object:
    robot = load_robot()
    parity = compare_models(robot, path, states=2)
    values = (parity.mass_matrix, parity.bias, parity.jacobian)
    assert all(value is None or np.isfinite(value) for value in values)
    assert parity.table()
    assert np.all(np.isfinite(mjcf_spec(robot, path).compile().body_inertia))
    return mjcf_sha256(path)


def read_parity(path: Path) -> object:
    return ForeignRobot.from_json(read_text(path, "again")).parity.table(full=True)


def read_scenario(path: Path) -> object:
    return Scenario.from_json(read_text(path, "again"))


KINDS = (
    Kind("gait library", "gaits.npz", read_gaits, (*BYTES, edit_arrays, edit_arrays)),
    Kind("gait library, sealed again", "gaits.npz", read_gaits, (forge,), input=True),
    Kind("gait", "gait.npz", read_gait, (*BYTES, edit_arrays, edit_arrays)),
    Kind("gait, sealed again", "gait.npz", read_gait, (forge,), input=True),
    Kind("torque library", "torques.npz", read_torques, (*BYTES, edit_arrays, edit_arrays)),
    Kind("torque library, sealed again", "torques.npz", read_torques, (forge,), input=True),
    Kind("URDF", "fuzz.urdf", read_urdf, (*BYTES, *[edit_xml] * 12), input=True),
    Kind("MJCF", "fuzz.xml", read_mjcf, (*BYTES, *[edit_xml] * 12), input=True),
    Kind("parity", "parity.json", read_parity, (*BYTES, *[edit_json] * 8), input=True),
    Kind("scenario", "scenario.json", read_scenario, (*BYTES, *[edit_json] * 8), input=True),
)


@pytest.fixture(scope="module")
def samples(robot: Robot, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A whole file of each name."""
    folder = tmp_path_factory.mktemp("samples")
    os.environ["PRONK_PIN_FUZZ"] = str(folder)
    options: dict[str, Any] = {"folder": folder / "gaits", "path": folder / "gaits.npz"}
    build_library(robot, [0.0], progress=False, **options)
    (gait,) = (folder / "gaits").glob("*.npz")
    shutil.copy(gait, folder / "gait.npz")
    rng = np.random.default_rng(0)
    torque = rng.standard_normal((2, 2, 5, 12))
    TorqueLibrary(np.array([0.1, 0.2]), torque, abs(torque), np.array([0.2, 0.21])).save(
        folder / "torques.npz"
    )
    shutil.copy(robot.urdf_path, folder / "fuzz.urdf")
    spec = mujoco_spec(robot)
    spec.compile()
    (folder / "fuzz.xml").write_text(spec.to_xml())
    foreign = ForeignRobot.read(robot, folder / "fuzz.xml")
    (folder / "parity.json").write_text(foreign.to_json())
    (folder / "scenario.json").write_text(load_scenario("payload+noise+slope").to_json())
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


@contextlib.contextmanager
def patience() -> Iterator[None]:
    """What takes longer is a fault."""

    def hang(*_: object) -> None:
        raise AssertionError(f"took more than {PATIENCE:g} s")

    before = signal.signal(signal.SIGALRM, hang)
    signal.setitimer(signal.ITIMER_REAL, PATIENCE)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def verdict(kind: Kind, path: Path, whole: object) -> str:
    """What is wrong with how a file was read; empty where nothing is."""
    try:
        with patience():
            found = kind.read(path)
    except PronkError as error:
        return "" if len(str(error).splitlines()) == 1 else f"several lines: {error}"
    except (Exception, MemoryError, RecursionError) as error:
        return f"{type(error).__name__}: {str(error)[:200]}"
    return "" if kind.input or found == whole else "accepted, and is not what it was"


def faults(kind: Kind, whole: bytes, folder: Path, count: int, *, first: int = 0) -> list[str]:
    """Damage a file in many ways, and list what goes wrong."""
    path = folder / kind.file
    path.write_bytes(whole)
    expected = kind.read(path)
    found = []
    for case in range(first, first + count):
        rng = np.random.default_rng([zlib.crc32(kind.name.encode()), case])
        damage = kind.damages[case % len(kind.damages)]
        path.write_bytes(damage(whole, rng))
        if wrong := verdict(kind, path, expected):
            found.append(f"case {case}, {damage.__name__}: {wrong}")
    return found


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
@pytest.mark.parametrize(
    "count", [100, pytest.param(1000, marks=pytest.mark.slow)], ids=["short", "long"]
)
def test_a_damaged_file_is_refused_in_one_line_or_is_what_it_was(
    kind: Kind, samples: dict[str, bytes], tmp_path: Path, count: int
) -> None:
    first = 0 if count == 100 else 100
    found = faults(kind, samples[kind.file], tmp_path, count, first=first)
    assert not found, "\n".join(found)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_what_is_no_file_is_refused_at_once(
    kind: Kind, samples: dict[str, bytes], tmp_path: Path
) -> None:
    path = tmp_path / kind.file
    assert not verdict(kind, path, None)  # missing
    path.mkdir()
    assert not verdict(kind, path, None)
    path.rmdir()
    os.mkfifo(path)
    assert not verdict(kind, path, None)
    path.unlink()
    path.symlink_to(path)
    assert not verdict(kind, path, None)
    path.unlink()
    with path.open("wb") as stream:
        stream.truncate(2**31)  # a hole, which takes no room
    assert not verdict(kind, path, None)
    for name in ("no\0name", "n" * 300):
        assert not verdict(kind, tmp_path / name, None)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ('<include file="fuzz.xml"/>', "includes fuzz.xml again"),
        ('<include file="other.xml"/>', "again"),
        ('<include file="/dev/zero"/>', "is not a file"),
        ('<asset><mesh name="x" file="pipe"/></asset>', "is not a file"),
        ('<worldbody><replicate count="1000000000"><body/></replicate></worldbody>', "parts|many"),
        (
            '<asset><texture type="2d" builtin="flat" width="99999" height="99999"/></asset>',
            "<texture> of",
        ),
        ('<size memory="1000G"/>', "bytes of memory"),
        ('<size nuser_body="1000000000"/>', "<size> of"),
    ],
)
def test_a_model_that_would_take_all_memory_or_time_is_refused_before_it_does(
    tmp_path: Path, text: str, problem: str
) -> None:
    path = tmp_path / "fuzz.xml"
    path.write_text(f"<mujoco>{text}</mujoco>")
    (tmp_path / "other.xml").write_text('<mujoco><include file="other.xml"/></mujoco>')
    os.mkfifo(tmp_path / "pipe")
    with patience(), pytest.raises(FileProblem, match=problem):
        mjcf_spec(load_robot(), path)


# Through the commands


@dataclass(frozen=True)
class Command:
    """A command that reads a file.

    Attributes:
        kind: What it reads; in a results folder, "".
        words: What is typed; `{file}`, `{folder}` and `{out}` stand for places.
        name: What the file has to be called; by default as always.
    """

    kind: str
    words: str
    name: str = ""


COMMANDS = (
    Command("gait library", "gaits show --library {file}"),
    Command("gait library", "gaits show 0 --library {file}"),
    Command("gait library", "gaits plot --library {file} --folder {out} --format svg"),
    Command("gait library", "view {file} --html {out}/page.html"),
    Command(
        "gait",
        "gaits build --speeds 0 --folder {folder} --output {out}/gaits.npz",
        "speed+0.000_apex0.3400.npz",
    ),
    Command("URDF", "parity {file} --states 2"),
    Command("MJCF", "parity {file} --states 2"),
)


class Said:
    """What a command has said, and how it ended."""

    def __init__(self, words: list[str], capfd: pytest.CaptureFixture[str]) -> None:
        capfd.readouterr()
        try:
            with patience():
                self.code: object = main(words)
        except SystemExit as error:
            self.code = error.code
        except (Exception, MemoryError, RecursionError) as error:
            self.code = f"{type(error).__name__}: {str(error)[:200]}"
        self.out, self.err = capfd.readouterr()

    def fault(self, whole: Said, *, judges: bool) -> str:
        """What is wrong with it, where a whole file is known to give something else."""
        lines = [line for line in self.err.splitlines() if "it/s" not in line]
        if self.code == whole.code and self.out == whole.out:
            return ""
        if self.code in (1, 2) and len(lines) == 1 and lines[0].startswith("pronk-pin: "):
            return ""
        if judges and self.code == 1 and not lines and "Not the same robot" in self.out:
            return ""
        return f"exit code {self.code}, {len(lines)} lines: {' | '.join(lines)[-300:]}"


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.words.split("{")[0])
@pytest.mark.parametrize(
    "count", [6, pytest.param(60, marks=pytest.mark.slow)], ids=["short", "long"]
)
def test_a_command_that_reads_a_damaged_file_says_so_in_one_line(
    command: Command,
    samples: dict[str, bytes],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    count: int,
) -> None:
    kind = next(kind for kind in KINDS if kind.name == command.kind)
    folder = tmp_path / "folder"
    folder.mkdir()
    path = folder / (command.name or kind.file)
    places = {"file": path, "folder": folder, "out": tmp_path / "out"}
    words = [word.format(**places) for word in command.words.split()]
    path.write_bytes(samples[kind.file])
    whole, found = Said(words, capfd), []
    assert whole.code == 0, whole.err
    for case in range(5000, 5000 + count):
        rng = np.random.default_rng([zlib.crc32(command.words.encode()), case])
        damage = kind.damages[case % len(kind.damages)]
        path.write_bytes(damage(samples[kind.file], rng))
        if wrong := Said(words, capfd).fault(whole, judges=kind.input):
            found.append(f"case {case}, {damage.__name__}: {wrong}")
    assert not found, "\n".join(found)


# Results folders, whose files are whatever is found in one

RESULT = Experiment(
    speeds=(0.0,),
    controllers=("pd", "ilc", "ilc-stance"),
    schedule=Schedule(startup=0.1, baseline=1.0, learning=1.0),
)
OPTIONS = (
    "--speeds 0 --controllers pd ilc ilc-stance --schedule.startup 0.1 --schedule.baseline 1 "
    "--schedule.learning 1 --workers 1"
)
RESULTS_COMMANDS = (
    "report {results}",
    "report {results} {whole}",
    "report {whole} {results}",
    "view {results} --html {out}/page.html",
    "explain {results} --draws 2",
    f"compare --folder {{results}} {OPTIONS}",
)
ANALYZE = "ilc analyze ilc-stance --result {results} --strides 1 --figure {out}/figure.svg"
UNREAD = {"report.md", "report.html", "replay.html"}
"""Files of a results folder that nothing reads."""


@pytest.fixture(scope="module")
def result(
    robot: Robot, samples: dict[str, bytes], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """A small results folder, in an MJCF so that it holds a parity.json too."""
    folder = tmp_path_factory.mktemp("results")
    (folder / "robot.xml").write_bytes(samples["fuzz.xml"])
    experiment = dataclasses.replace(RESULT, mjcf=str(folder / "robot.xml"))
    return run_experiment(experiment, folder / "whole", workers=1, progress=False).folder


def files(folder: Path) -> list[Path]:
    """Every file that is read again."""
    return sorted(
        path
        for path in folder.rglob("*")
        if path.is_file() and path.name not in UNREAD and path.parent.name != "figures"
    )


def edit_csv(data: bytes, rng: Rng) -> bytes:
    rows = [line.split(",") for line in data.decode().splitlines()]
    k, j = int(rng.integers(len(rows))), int(rng.integers(len(rows[0])))
    what = int(rng.integers(6))
    if what == 0:
        del rows[k]
    elif what == 1:
        rows.append(rows[k])
    elif what == 2:
        del rows[k][j]
    elif what == 3:
        rows[k].append("1")
    else:
        rows[k][j] = ["nan", "1.5", "", "x", "1e999", '"'][int(rng.integers(6))]
    return "\n".join(",".join(row) for row in rows).encode() + b"\n"


EDITS = {".json": (edit_json,) * 6, ".csv": (edit_csv,) * 6}


def read_result(folder: Path) -> object:
    """Everything that a results folder says; who made it and when may be lost."""
    results = Results.load(folder)
    _ = results.provenance
    found: list[object] = [repr(describe(results.experiment)), results.summary().to_csv()]
    found.append(None if results.foreign is None else results.foreign.parity.table(full=True))
    for cell in results.experiment.cells():
        strides = results.strides(cell)
        parts = [(name, strides[name].values) for name in strides.variables]
        found.append(repr(sorted(strides.attrs.items())))
        found += [(n, v.shape, hashlib.sha256(v.tobytes()).hexdigest()) for n, v in parts]
    return found


@pytest.mark.parametrize(
    "count", [16, pytest.param(400, marks=pytest.mark.slow)], ids=["short", "long"]
)
def test_a_results_folder_with_a_damaged_file_is_refused_or_what_it_was(
    result: Path, tmp_path: Path, count: int
) -> None:
    folder, found = tmp_path / "results", []
    shutil.copytree(result, folder)
    expected = read_result(folder)
    for path in files(folder):
        whole = path.read_bytes()
        kind = Kind("result", "", lambda _: read_result(folder), ())
        damages = (*BYTES, *EDITS.get(path.suffix, ()))
        for case in range(count):
            rng = np.random.default_rng([zlib.crc32(path.name.encode()), case])
            damage = damages[case % len(damages)]
            path.write_bytes(damage(whole, rng))
            if wrong := verdict(kind, folder, expected):
                found.append(f"{path.name}, case {case}, {damage.__name__}: {wrong}")
        path.write_bytes(whole)
    assert not found, "\n".join(found)


@pytest.mark.parametrize("command", RESULTS_COMMANDS, ids=lambda words: words.split("{whole}")[0])
@pytest.mark.parametrize(
    "count", [1, pytest.param(6, marks=pytest.mark.slow)], ids=["short", "long"]
)
def test_a_command_that_reads_a_damaged_result_says_so_in_one_line(
    result: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    command: str,
    count: int,
) -> None:
    """Figures are made of what was read, and not drawn."""
    monkeypatch.setattr("pronk_pin.viz.report.document.figure_bytes", lambda *_: b"a figure")
    folder, found = tmp_path / "results", []
    shutil.copytree(result, folder)
    world = ["--mjcf", str(result.parent / "robot.xml")] if command.startswith("compare") else []
    places = {"results": folder, "whole": result, "out": tmp_path / "out"}
    words = [word.format(**places) for word in command.split()] + world
    if command.startswith("compare"):
        Said(words, capfd)  # the first time, its pages are made
    whole = Said(words, capfd)
    assert whole.code == 0, whole.err
    for path in files(folder):
        before = path.read_bytes()
        damages = (*BYTES, *EDITS.get(path.suffix, ()))
        for case in range(count):
            rng = np.random.default_rng([zlib.crc32(f"{command}{path.name}".encode()), case])
            damage = damages[int(rng.integers(len(damages)))]
            path.write_bytes(damage(before, rng))
            if wrong := Said(words, capfd).fault(whole, judges=False):
                found.append(f"{path.name}, case {case}, {damage.__name__}: {wrong}")
        path.write_bytes(before)
    assert not found, "\n".join(found)


@pytest.mark.parametrize("name", ["config.json", "strides/ilc-stance_nominal_0.nc"])
def test_an_analysis_of_a_result_that_is_cut_off_says_so_in_one_line(
    result: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    """A whole one would be analysed for a minute."""
    shutil.copytree(result, tmp_path / "results")
    words = ANALYZE.format(results=tmp_path / "results", out=tmp_path).split()
    path = tmp_path / "results" / name
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    said = Said(words, capfd)
    assert said.code == 1
    assert len(said.err.splitlines()) == 1
