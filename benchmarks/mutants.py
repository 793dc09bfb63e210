"""Small faults put into the package one at a time, to see whether tests notice: `make mutants`.

    python benchmarks/mutants.py --faults 100 --seed 0
    python benchmarks/mutants.py --faults 12 --rooms viz/figures cli --own

A fault is one change of one expression: a sign, a comparison, a number, `and` for `or`, `min` for
`max`, a keyword argument left out, a statement left out. They are drawn with a seed, as many in
each room as in the others. For each one runs the test of its module, then those of its room, of
the rooms around it, and then all others, until one fails, in a copy of the repository. Tests that
take longer than the limit have not noticed. Prints a table by room, and each fault that nothing
noticed, and ends with 1 where fewer than `ALL` are noticed, or fewer than `EACH` in a room.

Why not mutmut or cosmic-ray: the one runs the whole suite first to learn which tests touch what,
and then every fault there is; the other knows one command for all. Neither draws by room, nor runs
the nearest tests first, without which a fault costs minutes. Some faults cannot be noticed, since
the changed program does the same: whoever reads the list has to say which.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
ALL, EACH = 0.9, 0.8
"""Shares of the faults that tests should notice: of all, and in each room."""

_OPERATORS: dict[type, str] = {
    ast.Add: "-",
    ast.Sub: "+",
    ast.Mult: "/",
    ast.Div: "*",
    ast.Pow: "*",
    ast.FloorDiv: "/",
    ast.Mod: "*",
    ast.Lt: ">=",
    ast.LtE: ">",
    ast.Gt: "<=",
    ast.GtE: "<",
    ast.Eq: "!=",
    ast.NotEq: "==",
    ast.Is: "is not",
    ast.IsNot: "is",
    ast.In: "not in",
    ast.NotIn: "in",
    ast.And: "or",
    ast.Or: "and",
}
_TWINS = {"min": "max", "sin": "cos", "any": "all", "argmin": "argmax", "minimum": "maximum"}
_TWINS |= {"floor": "ceil", "nanmin": "nanmax", "first": "last", "mean": "sum", "low": "high"}
_TWINS |= {twin: name for name, twin in _TWINS.items()}

_LOOKS = {"fontsize", "lw", "ms", "ha", "va", "alpha", "pad", "shrink", "zorder", "dpi", "ncols"}
_LOOKS |= {"rotation", "capsize", "linewidths", "labelsize", "dtype", "stacklevel"}
"""Arguments of taste, which no test should hold on to."""

_PASSED_OVER = (ast.JoinedStr, ast.Raise, ast.Import, ast.ImportFrom, ast.Assert)
"""What says something, and does nothing."""


@dataclass(frozen=True)
class Fault:
    """One change of one file.

    Attributes:
        path: The file, from the root.
        start, end: What is replaced, as offsets in bytes.
        old: What stands there.
        text: What stands there instead.
        line: Number of its first line.
    """

    path: Path
    start: int
    end: int
    old: str
    text: str
    line: int

    @property
    def room(self) -> str:
        """Folder of the file within the package."""
        return self.path.parent.relative_to("pronk_pin").as_posix()

    def put_into(self, source: bytes) -> bytes:
        """The file with the fault."""
        assert source[self.start : self.end].decode() == self.old
        return source[: self.start] + self.text.encode() + source[self.end :]

    def __str__(self) -> str:
        short = " ".join(self.old.split())
        short = short if len(short) < 50 else f"{short[:46]} ..."
        return f"{self.path}:{self.line}: {short} -> {' '.join(self.text.split()) or 'nothing'}"


def faults(path: Path) -> list[Fault]:
    """All faults of a file; of a few the file does not compile."""
    source = (ROOT / path).read_bytes()
    lines = [0]
    for line in source.splitlines(keepends=True):
        lines.append(lines[-1] + len(line))

    def place(node: ast.AST, *, end: bool = False) -> int:
        row, column = (
            (node.end_lineno, node.end_col_offset) if end else (node.lineno, node.col_offset)  # type: ignore[attr-defined]
        )
        return lines[row - 1] + column

    def change(start: int, end: int, text: str) -> Fault:
        return Fault(
            path, start, end, source[start:end].decode(), text, source.count(b"\n", 0, start) + 1
        )

    def between(left: ast.AST, right: ast.AST, old: type) -> Iterator[Fault]:
        start, end = place(left, end=True), place(right)
        gap = source[start:end].decode()
        sign = ast.unparse(_example(old)).split("a", 1)[1].rsplit("b", 1)[0].strip()
        if gap.count(sign) == 1 and "#" not in gap:
            new = gap.replace(sign, _OPERATORS[old])
            yield change(start, end, new)

    def of(node: ast.AST) -> Iterator[Fault]:
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
            texts = any(
                isinstance(s, ast.Constant) and isinstance(s.value, str) for s in _sides(node)
            )
            if not texts:
                yield from between(node.left, node.right, type(node.op))
        elif isinstance(node, ast.Compare) and len(node.ops) == 1:
            yield from between(node.left, node.comparators[0], type(node.ops[0]))
        elif isinstance(node, ast.BoolOp):
            yield from between(node.values[0], node.values[1], type(node.op))
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
            yield change(place(node), place(node.operand), "")
        elif isinstance(node, ast.Constant) and type(node.value) in (bool, int, float):
            value = node.value
            if isinstance(value, bool):
                text = str(not value)
            else:
                text = str(value + 1) if isinstance(value, int) else repr(2.0 * value or 1.0)
            yield change(place(node), place(node, end=True), text)
        elif isinstance(node, ast.Name | ast.Attribute):
            name = node.id if isinstance(node, ast.Name) else node.attr
            if name in _TWINS and isinstance(node.ctx, ast.Load):
                end = place(node, end=True)
                yield change(end - len(name), end, _TWINS[name])
        elif isinstance(node, ast.Call):
            for keyword in node.keywords:
                if keyword.arg is not None and keyword.arg not in _LOOKS:
                    end = place(keyword, end=True)
                    comma = len(source[end:]) - len(source[end:].lstrip(b" \n,"))
                    yield change(place(keyword), end + comma, "")
        elif isinstance(node, ast.AugAssign) or (
            isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
        ):
            yield change(place(node), place(node, end=True), "pass")

    return [fault for node in _acting(ast.parse(source)) for fault in of(node)]


def _example(operator: type) -> ast.expr:
    """The expression of an operator between a and b."""
    a, b = ast.Name("a"), ast.Name("b")
    if issubclass(operator, ast.boolop):
        return ast.BoolOp(operator(), [a, b])
    if issubclass(operator, ast.cmpop):
        return ast.Compare(a, [operator()], [b])
    return ast.BinOp(a, operator(), b)


def _sides(node: ast.BinOp) -> tuple[ast.expr, ast.expr]:
    return node.left, node.right


def _acting(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes below one that do something: neither annotations nor messages."""
    if isinstance(node, ast.Call):
        taste = [keyword for keyword in node.keywords if keyword.arg in _LOOKS]
        node = ast.Call(node.func, node.args, [k for k in node.keywords if k not in taste])
    for field, value in ast.iter_fields(node):
        if field in ("annotation", "returns", "decorator_list", "type_params"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not isinstance(child, _PASSED_OVER):
                if isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
                    continue
                yield child
                yield from _acting(child)


def _compiles(fault: Fault) -> bool:
    try:
        compile(fault.put_into((ROOT / fault.path).read_bytes()), "fault", "exec")
    except (SyntaxError, ValueError):
        return False
    return True


def draw(number: int, seed: int, rooms: list[str]) -> list[Fault]:
    """So many faults, as many of each room as of the others, the same for a seed."""
    by_room: dict[str, list[Path]] = defaultdict(list)
    for path in sorted((ROOT / "pronk_pin").rglob("*.py")):
        room = path.parent.relative_to(ROOT / "pronk_pin").as_posix()
        if path.name != "__main__.py" and (not rooms or room in rooms):
            by_room[room].append(path.relative_to(ROOT))
    if unknown := set(rooms) - set(by_room):
        raise SystemExit(
            f"there is no room {', '.join(sorted(unknown))}; take folders of pronk_pin"
        )
    rng = random.Random(seed)
    left = {
        room: [each for path in paths for each in faults(path)] for room, paths in by_room.items()
    }
    drawn: list[Fault] = []
    while len(drawn) < number and any(left.values()):
        order = sorted(room for room in left if left[room])
        for room in rng.sample(order, len(order))[: number - len(drawn)]:
            while left[room]:
                fault = left[room].pop(rng.randrange(len(left[room])))
                if _compiles(fault):
                    drawn.append(fault)
                    break
    return sorted(drawn, key=lambda fault: (fault.room, str(fault.path), fault.start))


def stages(fault: Fault, *, own: bool) -> Iterator[list[str]]:
    """Tests, nearest first: of the module, of its room, of the rooms around it, all others."""
    tests, run = ROOT / "tests", set[str]()
    folder = tests / fault.room
    groups = [[folder / f"test_{fault.path.stem}.py"], folder.glob("test_*.py")]
    outside = [place for place in (folder, *folder.parents) if place.is_relative_to(tests)]
    if own:  # a room without a folder of tests is tested in that of the room around it
        outside = next(([place] for place in outside if any(place.glob("test_*.py"))), [])
        groups += [place.glob("test_*.py") for place in outside]
    else:
        groups += [place.rglob("test_*.py") for place in outside]
    for group in groups:
        files = sorted(str(file.relative_to(ROOT)) for file in group if file.exists())
        new = [file for file in files if file.startswith("tests/") and file not in run]
        run |= {*new}
        if new:
            yield new


class Bench:
    """A copy of the repository in which one fault at a time is tried.

    Attributes:
        folder: Where it is.
        limit: Longest time of the tests of a fault [s].
    """

    def __init__(self, folder: Path, limit: float) -> None:
        self.folder, self.limit = folder, limit
        folder.chmod(0o755)  # some tests give up the rights of root
        listed = subprocess.check_output(["git", "ls-files", "-z"], cwd=ROOT, text=True)
        for name in filter(None, listed.split("\0")):
            source, target = ROOT / name, folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            if source.exists():
                shutil.copy2(source, target, follow_symlinks=False)
        # By the hash of the source: two faults may come within the second that times are kept to.
        keep = ["-m", "compileall", "-q", "--invalidation-mode", "checked-hash", "pronk_pin"]
        subprocess.run([sys.executable, *keep], cwd=folder, check=True)

    def failing(self, tests: list[str], limit: float) -> str:
        """The first of some tests that fails, by its name; "" where none does.

        Raises:
            TimeoutExpired: They take longer than so many seconds.
        """
        options = ["-x", "-q", "--no-header", "-p", "no:cacheprovider", "-p", "no:randomly"]
        command = [sys.executable, "-B", "-m", "pytest", *options, *tests]
        environment = {**os.environ, "PYTHONPATH": str(self.folder), "OMP_NUM_THREADS": "1"}
        done = subprocess.run(
            command,
            cwd=self.folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=max(limit, 1.0),
        )
        if done.returncode in (0, 5):  # 5: all of them are skipped or slow
            return ""
        told = re.findall(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", done.stdout, flags=re.MULTILINE)
        return told[0] if told else tests[0]

    def notices(self, fault: Fault, *, own: bool) -> str:
        """What became of a fault: "noticed", "not noticed", "no answer" in time, or "fails anyway"
        where the test that failed does so without it."""
        begin, path = time.monotonic(), self.folder / fault.path
        whole = path.read_bytes()  # which nobody else changes meanwhile
        for tests in stages(fault, own=own):
            path.write_bytes(fault.put_into(whole))
            try:
                failing = self.failing(tests, self.limit - (time.monotonic() - begin))
            except subprocess.TimeoutExpired:
                return "no answer"
            finally:
                path.write_bytes(whole)
            if failing and self.failing([failing], self.limit):
                print(f"{failing} fails without any fault, too", file=sys.stderr)
                return "fails anyway"
            if failing:
                return "noticed"
        return "not noticed"


def main() -> int:
    """Try faults, and print what became of them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--faults", type=int, default=100, help="how many (default: 100)")
    parser.add_argument("--seed", type=int, default=0, help="of the draw (default: 0)")
    parser.add_argument("--rooms", nargs="*", default=[], help="folders of pronk_pin; default all")
    parser.add_argument("--limit", type=float, default=900.0, help="of a fault [s] (default: 900)")
    parser.add_argument("--own", action="store_true", help="only the tests of the fault's own room")
    asked = parser.parse_args()
    results: dict[str, list[tuple[Fault, str]]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder), asked.limit)
        for fault in draw(asked.faults, asked.seed, asked.rooms):
            told = bench.notices(fault, own=asked.own)
            results[fault.room].append((fault, told))
            print(f"{told:12} {fault}", flush=True)
    print(f"\n{'room':28} faults  noticed")
    shares = {}
    for room, tried in sorted(results.items()):
        noticed = sum(told == "noticed" for _, told in tried)
        shares[room] = noticed / len(tried)
        print(f"{room:28} {len(tried):6d}  {noticed:7d}  {shares[room]:4.0%}")
    every = [told for tried in results.values() for _, told in tried]
    share = every.count("noticed") / max(len(every), 1)
    print(f"{'all':28} {len(every):6d}  {every.count('noticed'):7d}  {share:4.0%}")
    return int(share < ALL or min(shares.values(), default=1.0) < EACH)


if __name__ == "__main__":
    sys.exit(main())
