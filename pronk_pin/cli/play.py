"""The command `play`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Play:
    """Simulate robots live, beside each other, on a page where they are taught, loaded and pushed.

    Ctrl-C ends it. The token in the address of the page is its key.
    """

    controllers: tuple[str, ...] = ("pd", "model", "ilc")
    """Controllers, one robot each, up to three; they can be changed on the page."""
    scenario: str = "nominal"
    """Scenario to begin with, as payload=2+slope; the page changes it."""
    speed: float | None = None
    """Commanded speed to begin with [m/s]; by default the one of the gaits nearest to 0.5."""
    robot: str = "a1"
    """Robot: a name of `pronk-pin list robots`, a TOML file, or an address."""
    gaits: str = "pronk"
    """Its gaits: pronk, as shipped for it, or a file of `pronk-pin gaits build`."""
    seed: int = 0
    """Seed of the scatter at the start, and of noise."""
    rate: float = 1.0
    """Simulated seconds for each second; below 1 for slow motion."""
    folder: Path | None = None
    """Folder that the page's button records to, for `view` and `report`; by default
    results/<time>-play."""
    port: int | None = None
    """Port of the page; by default a free one."""
    host: str = "127.0.0.1"
    """Address that the page listens on; the default can be reached from this machine only."""
    open: bool = True
    """Open the page in the browser."""
    duration: float | None = None
    """End after so many seconds; by default on Ctrl-C."""

    def run(self) -> None:
        """Do it."""
        from .._checks import none_or, real
        from ..compare import Experiment
        from ..viz import live_lab, serve_lab
        from ..viz.player import DURATION, known_port

        known_port(self.port)
        none_or(real, "duration", self.duration, DURATION)
        experiment = Experiment(
            robot=self.robot,
            gaits=self.gaits,
            controllers=self.controllers,
            scenarios=(self.scenario,),
            seeds=(self.seed,),
        )
        lab = live_lab(
            experiment,
            speed=self.speed,
            rate=self.rate,
            folder=self.folder,
            port=self.port,
            host=self.host,
        )
        serve_lab(lab, open_browser=self.open, duration=self.duration)
