"""What the controllers known by name must know, and what a specification refuses."""

import pytest

from pronk_pin.control import CONTROLLERS, ComputedTorque, ControllerSpec
from pronk_pin.control.controller_spec import KNOWLEDGE
from pronk_pin.errors import InvalidInput, UnknownName


def test_what_a_controller_knows_goes_with_what_it_is_computed_from() -> None:
    """A model's torque knows the URDF, and where it is computed at every tick the rotors and the
    feet's forces too; gaits of the datasheet know the rotors; practice nothing."""
    for spec in CONTROLLERS.values():
        assert set(spec.knows) <= set(KNOWLEDGE)
        if isinstance(spec.tick_controller, ComputedTorque):
            assert spec.knows == ("urdf", "rotors", "foot forces")
            continue
        assert ("urdf" in spec.knows) == (spec.source in ("model", "identified"))
        if spec.gait_model == "datasheet":
            assert "rotors" in spec.knows
        if spec.source in ("none", "library") and spec.gait_model == "urdf":
            assert spec.knows == ()


def test_unknown_knowledge_and_gaits_are_refused() -> None:
    with pytest.raises(UnknownName, match="unknown knowledge 'weather'"):
        ControllerSpec("mine", knows=("weather",))
    with pytest.raises(UnknownName, match="model of the gaits"):
        ControllerSpec("mine", gait_model="mine")
    with pytest.raises(InvalidInput, match="give source='identified' too"):
        ControllerSpec("mine", gait_model="identified")
    with pytest.raises(InvalidInput, match="tick_controller=3 is no tick controller"):
        ControllerSpec("mine", tick_controller=3)  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match="plays no feedforward; leave out source, law"):
        ControllerSpec("mine", tick_controller=ComputedTorque(), source="model")
    with pytest.raises(InvalidInput, match="coupling"):
        ControllerSpec("mine", coupling=1.5)
