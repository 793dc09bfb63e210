"""Provenance of results: versions, machine, state of the source, and time.

It stands in a file of its own, provenance.json: everything else in a results folder is the same to
the bit whenever and by however many workers it is made.
"""

from __future__ import annotations

import importlib.metadata
import os
import platform
import shutil
import subprocess
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_info

from ...storage import as_type, read_sealed

PROVENANCE = "provenance.json"
"""Its name."""

_PACKAGES = (
    *("pronk-pin", "pin", "example-robot-data", "mujoco", "proxsuite"),
    *("daqp", "numpy", "scipy"),
)
_TIMEOUT = 10.0  # [s], for git


@dataclass(frozen=True)
class _Document:
    """What the file holds."""

    finished: bool
    runs: list[dict[str, Any]]


def read_provenance(folder: Path) -> dict[str, Any]:
    """Read it: whether the run is `finished`, and its `runs`, first to last.

    Raises:
        FileProblem: It is damaged.
    """
    path = folder / PROVENANCE
    if not path.is_file():
        return {"finished": False, "runs": []}
    remedy = "delete it: only the record of who made it is lost"
    return asdict(as_type(read_sealed(path, remedy), _Document, path, remedy))


def versions() -> dict[str, str]:
    """Versions of the packages that make the numbers."""
    return {name: importlib.metadata.version(name) for name in _PACKAGES}


def describe_run() -> dict[str, Any]:
    """Describe a run that begins now, for provenance.json."""
    return {
        "started": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "versions": versions(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        **machine(),
        "cores": os.cpu_count(),
        "git": git_state(),
    }


def machine() -> dict[str, str]:
    """Processor and BLAS kernels: with the versions, what the last bits of numbers depend on."""
    kernels = {
        " ".join(str(info.get(key)) for key in ("internal_api", "version", "architecture"))
        for info in threadpool_info()
        if info.get("user_api") == "blas"
    }
    return {"cpu": cpu_name(), "blas": ", ".join(sorted(kernels))}


def cpu_name() -> str:
    """The processor's name, as far as the system tells."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def git_state(source: Path | None = None) -> str | None:
    """Commit of a source file's repository, with "changed" if it differs; None outside of one.

    Args:
        source: The file, by default this one. A repository that only surrounds an installed
            package does not count: it does not track the file.
    """
    source = (source or Path(__file__)).resolve()
    if shutil.which("git") is None or _git(source, "ls-files", "--error-unmatch", source) is None:
        return None
    commit = _git(source, "rev-parse", "HEAD")
    if commit is None:
        return None
    changed = _git(source, "status", "--porcelain", "--untracked-files=no")
    return commit if changed == "" else f"{commit}, changed"


def _git(source: Path, *arguments: str | Path) -> str | None:
    """Output of a git command, None where it fails."""
    try:
        done = subprocess.run(
            ["git", "-C", source.parent, *arguments],
            capture_output=True,
            text=True,
            timeout=_TIMEOUT,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
