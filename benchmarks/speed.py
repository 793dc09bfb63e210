"""All measurements of speed, one after the other, by one command: `make benchmarks`.

Prints what each prints, and then a table: a row a benchmark, what it took, and whether it ended
well. With names only those: `python benchmarks/speed.py dynamics viz`. On a busy machine ratios
within one row are worth more than times.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import time
from pathlib import Path

FOLDER = Path(__file__).parent
BENCHMARKS = (
    *("command_line", "dynamics", "throughput", "tick_controllers", "engines", "viz", "gaits"),
)
"""Files beside this one; those that measure how good something is, not how fast, are left out."""


def processor_time() -> float:
    """Processor time of the processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Run the benchmarks that are asked for, and print the table.

    Raises:
        SystemExit: One is not there, or has failed.
    """
    asked = sys.argv[1:] or list(BENCHMARKS)
    if unknown := set(asked) - set(BENCHMARKS):
        sys.exit(f"no benchmark {', '.join(sorted(unknown))}; choose {', '.join(BENCHMARKS)}")
    rows, failed = [], []
    for name in asked:
        print(f"== {name}", flush=True)
        begun, used = time.monotonic(), processor_time()
        code = subprocess.run([sys.executable, FOLDER / f"{name}.py"], check=False).returncode
        failed += [name] if code else []
        wall, used = time.monotonic() - begun, processor_time() - used
        rows.append(f"{name:<18}{wall:>9.1f}{used:>9.1f}  {'done' if not code else f'code {code}'}")
    print(f"\n{'benchmark':<18}{'wall [s]':>9}{'CPU [s]':>9}")
    print("\n".join(rows))
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
