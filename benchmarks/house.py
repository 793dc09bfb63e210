"""Sizes of the package: `python benchmarks/house.py`.

Prints the fullest rooms (files, faces aside), the longest file, the longest function and the lines
of the whole package, docstrings, comments and empty lines included.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "pronk_pin"


def functions(path: Path) -> Iterator[tuple[int, str]]:
    """Lines and place of every function of a file, from its first decorator to its end."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            first = min([node.lineno, *(each.lineno for each in node.decorator_list)])
            place = f"{path.relative_to(ROOT)}:{node.lineno} {node.name}"
            yield (node.end_lineno or first) - first + 1, place


def main() -> None:
    """Measure the package, and print it."""
    files = sorted(PACKAGE.rglob("*.py"))
    rooms = Counter(path.parent for path in files if path.name != "__init__.py")
    lengths = {path: len(path.read_text().splitlines()) for path in files}
    most = max(rooms.values())
    full = ", ".join(str(room.relative_to(ROOT)) for room in sorted(rooms) if rooms[room] == most)
    longest = max(lengths, key=lengths.__getitem__)
    lines, place = max(each for path in files for each in functions(path))
    print(f"fullest rooms     {most:5d} files  {full}")
    print(f"longest file      {lengths[longest]:5d} lines  {longest.relative_to(ROOT)}")
    print(f"longest function  {lines:5d} lines  {place}")
    print(f"the package       {sum(lengths.values()):5d} lines  in {len(files)} files")


if __name__ == "__main__":
    main()
