"""A hand-made motion, and a headless browser to look at it with."""

from __future__ import annotations

import io
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pronk_pin.compare import Experiment, Results, Schedule, run_experiment
from pronk_pin.errors import NoBrowser
from pronk_pin.robot import Robot, load_robot
from pronk_pin.viz import Mark, Scene, Track
from pronk_pin.viz.player.browser import Browser


class Eye(Browser):
    """A headless browser whose pictures are arrays."""

    def look(self) -> np.ndarray:
        """What is on the screen, shape (height, width, 3), from 0 to 255."""
        return np.asarray(Image.open(io.BytesIO(self.screenshot())).convert("RGB")).astype(int)

    def scenery(self) -> np.ndarray:
        """The robots and the ground: below the words, left of the panel."""
        return self.look()[220:640, :640]


@pytest.fixture(scope="session")
def _browser() -> Iterator[Eye]:
    try:
        eye = Eye(960, 700)
    except NoBrowser as error:
        pytest.skip(f"the page cannot be looked at: {error}")
    with eye:
        yield eye


@pytest.fixture
def browser(_browser: Eye) -> Eye:
    """A headless browser, without a network beyond this machine."""
    # The page of the test before looks for its server again once that has ended: leave it first.
    _browser.call("Page.navigate", url="about:blank")
    time.sleep(0.2)
    _browser.run("0")  # takes in what it still has to say
    _browser.errors.clear()
    return _browser


@pytest.fixture(scope="session")
def robot() -> Robot:
    """The A1."""
    return load_robot("a1")


@pytest.fixture(scope="session")
def hop(robot: Robot) -> Track:
    """A robot that hops on bent legs at 0.5 m/s for five seconds, pushing while it stands."""
    t = np.arange(0.0, 5.0, 0.01)
    phase = (t / 0.4) % 1.0
    bend = np.where(phase < 0.5, np.sin(2.0 * np.pi * phase), 0.0)
    air = np.where(phase >= 0.5, np.sin(2.0 * np.pi * (phase - 0.5)), 0.0)
    q = np.tile(robot.standing, (len(t), 1))
    q[:, 0] = 0.5 * t
    q[:, 2] += 0.06 * air - 0.05 * bend
    q[:, 8::3] += 0.2 * (bend + air)[:, None]
    q[:, 9::3] -= 0.4 * (bend + air)[:, None]
    forces = np.zeros((len(t), 4, 3))
    forces[:, :, 2] = 80.0 * bend[:, None]
    error = 0.05 * np.sin(np.arange(12) + 3.0 * t[:, None])
    torque = np.linspace(-10.0, 10.0, 12) * bend[:, None]
    marks = [
        Mark(0.4 * k + shift, k, phase)
        for k in range(13)
        for shift, phase in ((0.0, "stance"), (0.2, "flight"))
    ]
    channels = {"forces": forces, "error": error, "torque": torque}
    return Track("robot", t, q, **channels, marks=marks, caption="hops")


@pytest.fixture(scope="session")
def scene(robot: Robot, hop: Track) -> Scene:
    """The hopping robot and, a little behind it, its ghost."""
    q = hop.q.copy()
    q[:, 0] -= 0.1
    ghost = Track("reference", hop.t, q, ghost=True)
    words = {"title": "Hop", "caption": "0.5 m/s <made by hand>"}
    return Scene(robot, (hop, ghost), **words, friction=0.6)


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Two speeds and three controllers, a few seconds each."""
    experiment = Experiment(
        speeds=(0.0, 0.5),
        controllers=("pd", "ilc", "model"),
        schedule=Schedule(baseline=5.0, learning=6.0),
    )
    folder: Path = tmp_path_factory.mktemp("results") / "short"
    return run_experiment(experiment, folder, workers=1, progress=False)
