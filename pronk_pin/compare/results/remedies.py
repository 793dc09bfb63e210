"""What to do where a results folder lacks something, or holds something else."""

from __future__ import annotations

from pathlib import Path

MAKE_ONE = "run 'pronk-pin compare' to make one"
"""There is no result, or no whole one."""

SIMULATE_AGAIN = "choose another folder, or add --resimulate to simulate it again"
"""Something was made for another experiment."""


def make_anew(folder: Path) -> str:
    """Strides are missing or damaged."""
    return f"run 'pronk-pin compare --folder {folder} --resimulate' to make it anew"


def complete(folder: Path) -> str:
    """Something is missing that a run makes."""
    return f"run 'pronk-pin compare --folder {folder}' to make it"


def no_room(folder: Path) -> str:
    """Nothing can be written."""
    return f"make room, and run the same command again with --folder {folder}"
