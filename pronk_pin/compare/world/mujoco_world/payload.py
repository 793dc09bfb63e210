"""The payload on the trunk, at its place, and the trunk's shifted centre of mass."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio as pin

from ....robot.formats import body_inertia, set_body_inertia
from ..scenario import Scenario


def apply_payload(trunk: mujoco.MjsBody, scenario: Scenario) -> None:
    """Shift the trunk's centre of mass, and merge the payload into its inertia.

    A body of its own for the payload would be fused wrongly (MuJoCo 4.0.0 doubles its offset).

    Args:
        trunk: The trunk; its inertia stands in `inertia` and `iquat`.
        scenario: The scenario.
    """
    trunk.ipos = np.array(trunk.ipos) + np.array(scenario.com_shift)
    if scenario.payload == 0.0:
        return
    point = pin.Inertia(scenario.payload, np.array(scenario.payload_position), np.zeros((3, 3)))
    set_body_inertia(trunk, body_inertia(trunk) + point)
