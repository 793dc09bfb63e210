"""The guard of a learner: what it keeps, when it goes back, and by how much it slows down."""

import numpy as np
import pytest

from pronk_pin.control.learning import GuardState, LearningGuard, Memory
from pronk_pin.errors import InvalidInput

SETTINGS = LearningGuard(window=3, growth=1.5, margin=0.01, patience=2, shrink=0.5, least=0.2)


def memory(value: float, n: int = 1) -> Memory:
    """A feedforward and a flight duration that are recognised by their value."""
    return Memory(np.full((n, 2, 4, 12), value), np.full(n, value))


def play(state: GuardState, errors: list[float], usable: bool = True) -> list[bool]:
    """Judge strides of one robot with these errors, each played with a memory of its error."""
    row, is_usable = np.array([0]), np.array([usable])
    return [bool(state.judge(row, is_usable, np.array([e]), memory(e))[0]) for e in errors]


def test_the_mean_of_the_best_window_is_kept() -> None:
    """Of 6 5 4 3 the windows are 6 5 4 and 5 4 3: the second is better, and its mean is 4."""
    state = GuardState(SETTINGS, memory(9.0))
    assert play(state, [6.0, 5.0, 4.0, 3.0]) == [False] * 4
    np.testing.assert_allclose(state.best.feedforward, 4.0)
    np.testing.assert_allclose(state.best.flight, 4.0)
    assert state.step[0] == 1.0
    assert state.rollbacks[0] == 0


def test_before_the_first_window_the_beginning_is_kept() -> None:
    """Nothing is the best that was learned, as long as no window is full."""
    state = GuardState(SETTINGS, memory(9.0))
    play(state, [6.0, 5.0])
    np.testing.assert_allclose(state.best.feedforward, 9.0)


def test_growing_errors_go_back_and_slow_down() -> None:
    """Windows of 0.1, then 0.15 ... : the second one above 1.5 times the best goes back."""
    state = GuardState(SETTINGS, memory(9.0))
    before = play(state, [0.1, 0.1, 0.1])
    # Root mean squares of the windows: 0.100, 0.141, 0.173 (over the limit), 0.200 (again).
    after = play(state, [0.2, 0.2, 0.2, 0.2])
    assert before == [False] * 3
    assert after == [False, False, True, False]
    np.testing.assert_allclose(state.best.feedforward, 0.1)
    assert state.step[0] == pytest.approx(0.5)
    assert state.rollbacks[0] == 1


def test_a_small_error_may_grow_by_the_margin() -> None:
    """Of 0.001 the limit is 0.011, not 0.0015: what grows within the margin is not held up."""
    state = GuardState(SETTINGS, memory(9.0))
    assert not any(play(state, [0.001] * 3 + [0.01] * 20))


def test_skipped_strides_go_back_too() -> None:
    """Strides that teach nothing never reach the law: they count by themselves."""
    state = GuardState(SETTINGS, memory(9.0))
    assert play(state, [0.1, 0.1], usable=False) == [False, True]
    assert play(state, [0.1], usable=False) == [False]
    assert play(state, [0.1]) == [False]  # one that counts in between
    assert play(state, [0.1], usable=False) == [False]
    assert state.rollbacks[0] == 1


def test_steps_never_fall_below_the_least() -> None:
    """Ten times back: 0.5, 0.25, and then no less than 0.2."""
    state = GuardState(SETTINGS, memory(9.0))
    play(state, [0.1] * 20, usable=False)
    assert state.rollbacks[0] == 10
    assert state.step[0] == pytest.approx(0.2)


def test_robots_are_judged_by_themselves() -> None:
    """One robot's growing errors leave its neighbour alone, wherever they stand in the batch."""
    state = GuardState(SETTINGS, memory(9.0, n=3))
    for k in range(6):
        error = np.array([0.1 if k < 3 else 0.3, 0.1])
        back = state.judge(np.array([2, 0]), np.array([True, True]), error, memory(1.0, n=2))
        assert back.tolist() == [k == 4, False]
    assert state.rollbacks.tolist() == [0, 0, 1]
    np.testing.assert_allclose(state.best.feedforward[1], 9.0)


def test_what_is_kept_is_a_copy() -> None:
    """The memory goes on being learned in place; what is kept must not change with it."""
    played = memory(9.0)
    state = GuardState(SETTINGS, played)
    played.feedforward[:] = 0.0
    np.testing.assert_allclose(state.best.feedforward, 9.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"window": 0}, "window"),
        ({"growth": 0.5}, "growth"),
        ({"shrink": 1.5}, "shrink"),
        ({"margin": float("nan")}, "margin"),
        ({"patience": 1.5}, "patience"),
    ],
)
def test_settings_are_checked(changes: dict[str, float], message: str) -> None:
    """A window without strides, or a guard that speeds up, is refused by name."""
    with pytest.raises(InvalidInput, match=message):
        LearningGuard(**changes)  # type: ignore[arg-type]
