"""How a trunk may move: the words for it."""

from __future__ import annotations

from typing import Literal

Base = Literal["locked", "sagittal", "free"]
"""How a gait's trunk may move: along x and z only, as in the paper, pitching too, or anyhow."""

BASES = ("locked", "sagittal", "free")
"""How a trunk may move: along x and z only, pitching too, or anyhow."""
