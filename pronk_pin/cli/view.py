"""The command `view`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypedDict

from tyro.conf import Positional, arg

from .gaits import open_library, robot_of

if TYPE_CHECKING:
    from ..viz import Menu


class FilmOptions(TypedDict, total=False):
    """Fields of a `viz.Film`."""

    width: int
    """Width of the picture [pixels]; by default 800."""
    height: int
    """Height of the picture [pixels]; by default 600."""
    plots: bool
    """Show the plots of error and torque beside the robots; by default they are left out."""
    color: str
    """Colour the links by "error" or "torque"; by default as they are."""
    fps: float
    """Frames for each second of the film; by default 25."""
    rate: float
    """Seconds of the scene for each second of the film; below 1 for slow motion; by default 1."""
    at: float
    """Time at which the film begins, or of the picture, from the scene's beginning [s]; by default
    0."""
    seconds: float | None
    """How much of the scene the film shows [s]; by default to its end."""


@dataclass(frozen=True)
class View:
    """Show a motion: a result's robots beside their references, or a library's gaits.

    Without --html, --png, --gif or --mp4, on a live page with controls.
    """

    what: Positional[Path | None] = None
    """Results folder or gait library; by default the shipped gaits."""
    speed: float | None = None
    """Speed [m/s]; by default the one nearest to 0.5."""
    command: str | None = None
    """Speed profile of a result of commanded speeds; by default the first."""
    apex: float | None = None
    """Apex of a gait library [m]; by default the library's own."""
    controller: str | None = None
    """Controller of a result; by default ilc."""
    scenario: str | None = None
    """Scenario of a result; by default the first."""
    beside: str | None = None
    """Robot to show beside it: another controller of the result, 'PD and the model', 'before
    learning', or 'nothing'; by default PD and the model, as far as the result has them, beside
    one that learns."""
    stride: int | None = None
    """Show the dozen strides of a result with this one; by default those around the start of
    learning."""
    robot: str = "a1"
    """Robot whose gaits are shown: its name, or the TOML file of one of your own."""
    gait: str = "pronk"
    """Style of its shipped gaits: pronk, bound or trot."""
    base: str | None = None
    """Base mode of the library, locked or sagittal; by default the gait's own."""
    port: int | None = None
    """Port of the page; by default a free one."""
    host: str = "127.0.0.1"
    """Address that the page listens on; the default can be reached from this machine only."""
    open: bool = True
    """Open the page in the browser."""
    duration: float | None = None
    """End the page after so many seconds; by default on Ctrl-C."""
    html: Path | None = None
    """Write the page to this file instead, which opens offline; by default it is served."""
    png: Path | None = None
    """Write a picture to this file instead; by default none."""
    gif: Path | None = None
    """Write an animation to this file instead; by default none."""
    mp4: Path | None = None
    """Write a video to this file instead; by default none."""
    film: Annotated[FilmOptions, arg(name="")] = field(default_factory=FilmOptions)
    """Size and rate of pictures and films."""

    def run(self) -> None:
        """Do it."""
        from .._checks import NOT_NEGATIVE, none_or, real, whole
        from ..viz import Film, serve, write_film, write_png, write_replay
        from ..viz.player import DURATION, check_film, known_port

        film = Film(**self.film)
        known_port(self.port)
        none_or(real, "duration", self.duration, DURATION)
        for name in ("speed", "apex"):
            none_or(real, name, getattr(self, name))
        none_or(whole, "stride", self.stride, NOT_NEGATIVE)
        for path in (self.png, self.gif, self.mp4):
            if path is not None:
                check_film(path)  # what is missing is told before anything is read or drawn
        menu = self._menu()
        if self.html is not None:
            print(f"replay  {write_replay(menu, self.html)}")
        if self.png is not None:
            print(f"picture {write_png(menu.scene(), self.png, film)}")
        for path in (self.gif, self.mp4):
            if path is not None:
                print(f"film    {write_film(menu.scene(), path, film)}")
        if all(path is None for path in (self.html, self.png, self.gif, self.mp4)):
            serve(
                menu,
                port=self.port,
                host=self.host,
                open_browser=self.open,
                duration=self.duration,
            )

    def _refuse(self, options: tuple[str, ...], other: str) -> None:
        """Refuse options of something else than what is shown."""
        from ..errors import InvalidInput

        for name in options:
            if getattr(self, name) is not None:
                raise InvalidInput(f"--{name} is for {other}; name one, or leave the option out")

    def _menu(self) -> Menu:
        from ..compare import Results
        from ..errors import FileProblem
        from ..viz import library_menu
        from ..viz.scenes import result_menu

        if self.what is not None and self.what.is_dir():
            self._refuse(("apex",), "a gait library")
            return result_menu(
                Results.load(self.what),
                speed=self.speed,
                controller=self.controller,
                scenario=self.scenario,
                beside=self.beside,
                stride=self.stride,
                command=self.command,
            )
        if self.what is not None and not self.what.exists() and self.what.suffix != ".npz":
            raise FileProblem(
                self.what,
                "no such results folder or gait library",
                "make the one with 'pronk-pin compare --folder', the other with 'pronk-pin gaits "
                "build --output'",
            )
        self._refuse(("command", "controller", "scenario", "beside", "stride"), "a results folder")
        library = open_library(self.what, self.robot, self.gait, self.base)
        return library_menu(
            library, speed=self.speed, apex=self.apex, robot=robot_of(library, self.robot)
        )
