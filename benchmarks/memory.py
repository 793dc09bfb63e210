"""What a command takes of the memory: `python benchmarks/memory.py [COMMAND...]` (Linux).

Runs `pronk-pin compare --suite mismatch` with two workers, or the command given, and prints the
peak of the memory of all its processes. Pages that processes share are counted once (PSS), ten
times a second; a page that lived for less may have been missed.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

PERIOD = 0.1  # [s]
MISMATCH = ("-m", "pronk_pin", "compare", "--suite", "mismatch", "--workers", "2", "--folder")


def family(pid: int) -> Iterator[int]:
    """A process and all that come from it."""
    yield pid
    for children in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            below = children.read_text().split()
        except OSError:
            continue  # it ended meanwhile
        for child in below:
            yield from family(int(child))


def memory(pid: int) -> int:
    """Proportional set size of a process [kB]; 0 where it has ended."""
    try:
        found = re.search(r"^Pss:\s+(\d+)", Path(f"/proc/{pid}/smaps_rollup").read_text(), re.M)
    except OSError:
        return 0
    return int(found[1]) if found else 0


def watch(command: list[str]) -> int:
    """Run a command, print what it took, and give back its exit code."""
    began, peak = time.monotonic(), (0, 0, 0.0)
    process = subprocess.Popen(command)
    while process.poll() is None:
        parts = [memory(pid) for pid in family(process.pid)]
        peak = max(peak, (sum(parts), sum(part > 0 for part in parts), time.monotonic() - began))
        time.sleep(PERIOD)
    print(
        f"\npeak of the sum of PSS {peak[0] / 1e6:.2f} GB, over {peak[1]} processes, after "
        f"{peak[2]:.0f} s of {time.monotonic() - began:.0f} s"
    )
    return process.returncode


def main() -> int:
    """Watch the command given, or the suite of mismatches in a folder that is thrown away."""
    if len(sys.argv) > 1:
        return watch(sys.argv[1:])
    with tempfile.TemporaryDirectory() as folder:
        return watch([sys.executable, *MISMATCH, f"{folder}/result"])


if __name__ == "__main__":
    sys.exit(main())
