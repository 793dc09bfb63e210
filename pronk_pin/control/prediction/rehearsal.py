"""Rehearsal: learning simulated in the planar model, as if the model were the robot.

The lifted model is a first-order one, and a law that changes its feedforward in large steps leaves
its range: legs that swing at 20 rad/s are held once the flight's reference has ended, so that a
longer flight moves the touchdown's posture up to there and no further. The rehearsal plays the
strides themselves.
"""

from __future__ import annotations

import numpy as np

from ..._typing import Array
from ...errors import InvalidInput
from ..learning import LearningLaw
from ..signals import StrideRecord
from .planar_strides import PlanarStrides


def rehearse(strides: PlanarStrides, law: LearningLaw, begin: StrideRecord, number: int) -> Array:
    """Predict the errors of the strides of learning by simulating them in the model [rad].

    The model's error in the stride before the learning is taken to stay as it is.

    Args:
        strides: The strides of the planar model, whose feedforward is set.
        law: The law of the stance.
        begin: The last stride before learning, of one robot.
        number: How many strides of learning.

    Returns:
        Shape (number + 1, samples, 12), the first that of `begin`; NaN from where the model does
        not go on.

    Raises:
        InvalidInput: The model does not settle on an orbit with the feedforward of `begin`.
    """
    gains, record = strides.settings.gains, begin
    strides.set_feedforward(begin.feedforward[0])
    stance, _, landing = strides.orbit()
    error_offset, rate_offset = (
        recorded[0] - simulated
        for recorded, simulated in zip(
            (begin.error, begin.error_rate), strides.stance_errors(stance), strict=True
        )
    )
    errors = np.full((number + 1, *begin.error.shape[1:]), np.nan)
    errors[0] = begin.error[0]
    for k in range(1, number + 1):
        feedforward = law.update(record)
        strides.set_feedforward(feedforward[0])
        try:
            stance = strides.play_stance(strides.impact(landing))
            _, landing = strides.play_flight(stance.states[-1], stance.standing[-1])
        except InvalidInput:  # it does not come down
            break
        error, rate = strides.stance_errors(stance)
        errors[k], rate = error + error_offset, rate + rate_offset
        feedback = gains.feedback(errors[k], rate)
        record = StrideRecord.of(errors[k][None], rate[None], feedback[None], feedforward)
    return errors
