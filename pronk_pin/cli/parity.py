"""The command `parity`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tyro.conf import Positional

from .._display import show


@dataclass(frozen=True)
class Parity:
    """Tell whether an MJCF or a URDF is the same robot as ours; exit with 1 where it is not.

    Prints what differs of masses, joints and motors, and the largest differences of M, h and J on
    random states. Without a model, our robot in Pinocchio is compared with MuJoCo's reading of
    the same URDF.
    """

    model: Positional[Path | None] = None
    """MJCF or URDF to compare with; by default MuJoCo's reading of our URDF."""
    robot: str = "a1"
    """Robot it should be: a name of `pronk-pin list robots`, a TOML file, or an address."""
    states: int = 200
    """Number of random states."""
    seed: int = 0
    """Seed of the random states."""
    tolerance: float | None = None
    """Relative difference up to which values agree; by default 1e-9, or 1e-5 for an MJCF whose
    numbers have six digits, as MuJoCo writes them."""
    full: bool = False
    """Print every row of the table, not only those that differ."""

    def run(self) -> int:
        """Do it; the exit code is 0 where the two are the same."""
        import numpy as np

        from .._checks import seed
        from ..parity import compare_models
        from ..robot import load_robot
        from ..robot.formats import mujoco_spec

        seed("seed", self.seed)
        robot = load_robot(self.robot)
        parity = compare_models(
            robot,
            mujoco_spec(robot).compile() if self.model is None else self.model,
            states=self.states,
            rng=np.random.default_rng(self.seed),
            tolerance=self.tolerance,
        )
        show(parity.table(full=self.full))
        return 0 if parity.agrees else 1
