"""Processor time of `pronk-pin --help`, and of each command's: `python benchmarks/command_line.py`.

A row a help: seconds that the whole process takes of a processor (user and system), and its ratio
to `python -c "import numpy"`. Medians of ten pairs, the two in turn, so that what else the machine
does falls on both.
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys

PAIRS = 10
NUMPY = ("-c", "import numpy")
COMMANDS = (
    *("", "compare", "compare --suite mismatch", "view", "report", "reproduce", "explain"),
    *("gaits", "gaits build", "gaits show", "gaits plot", "parity", "list"),
    *("ilc", "ilc analyze", "ilc stability", "ilc gains", "ilc transfer", "ilc seeding"),
)


def spent(*arguments: str) -> float:
    """Processor time of a Python with these arguments [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Print the table, of all commands or of those given as arguments."""
    print(f"{'help of':<26}{'CPU [s]':>9}{'numpy [s]':>11}{'ratio':>8}")
    for command in sys.argv[1:] or COMMANDS:
        asked = ("-m", "pronk_pin", *command.split(), "--help")
        spent(*asked)  # compiles what changed since
        pairs = [(spent(*asked), spent(*NUMPY)) for _ in range(PAIRS)]
        ours, numpy = (statistics.median(times) for times in zip(*pairs, strict=True))
        ratio = statistics.median(one / other for one, other in pairs)
        print(f"pronk-pin {command:<16}{ours:>9.3f}{numpy:>11.3f}{ratio:>8.2f}")


if __name__ == "__main__":
    main()
