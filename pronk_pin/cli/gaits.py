"""Commands about gait libraries: `gaits build | show | plot`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, subcommand

from .._display import show

if TYPE_CHECKING:
    from ..gait import GaitLibrary
    from ..robot import Robot


@dataclass(frozen=True)
class Build:
    """Optimise a gait library anew, from one gait outward.

    Each gait is kept in a folder as soon as it is solved: run the same command again, and it
    completes what is missing.
    """

    robot: str = "a1"
    """Robot: its name, or the TOML file of one of your own."""
    gait: str = "pronk"
    """Gait style: pronk, bound or trot."""
    base: str | None = None
    """Base mode: locked (trunk along x and z only) or sagittal (pitching too); by default the
    gait's own."""
    speeds: tuple[str, ...] = ()
    """Speeds [m/s], each a number or a range A:B:STEP; by default the gait's own."""
    apex: tuple[str, ...] = ()
    """Greatest heights of the trunk [m], each a number or a range A:B:STEP; by default the
    gait's own."""
    output: Path = Path("gaits.npz")
    """File to write."""
    folder: Path | None = None
    """Folder for each solved gait; by default beside the output, with '.build' to its name."""
    workers: int | None = None
    """Processes; by default one for each core."""

    def run(self) -> None:
        """Do it."""
        from .._checks import shown
        from ..errors import InvalidInput
        from ..gait import build_library, describe_library, known_base, number_range
        from ..robot import load_robot

        if not self.output.name or self.output.is_dir():
            raise InvalidInput(
                f"output={shown(str(self.output))} is no file; give the name of one, as gaits.npz"
            )
        folder = self.folder or self.output.with_name(self.output.name + ".build")
        base = None if self.base is None else known_base(self.base)
        library = build_library(
            load_robot(self.robot),
            number_range("speeds", self.speeds) or None,
            apexes=number_range("apex", self.apex) or None,
            gait=self.gait,
            base=base,
            path=self.output,
            folder=folder,
            workers=self.workers,
        )
        show(describe_library(library))
        print(f"\ngaits   {self.output}\nfolder  {folder}  (each gait; no longer needed)")


@dataclass(frozen=True)
class _OfLibrary:
    """Selection of gaits of a library."""

    apex: float | None = None
    """Greatest height of the trunk [m]; by default the library's own."""
    library: Path | None = None
    """Library file; by default the shipped one."""
    robot: str = "a1"
    """Robot whose library it is: its name, or the TOML file of one of your own."""
    gait: str = "pronk"
    """Gait style of the shipped library: pronk, bound or trot."""
    base: str | None = None
    """Base mode of the library, locked or sagittal; by default the gait's own."""

    def load(self) -> GaitLibrary:
        """The library, even one that failed its audit."""
        return open_library(self.library, self.robot, self.gait, self.base, audited=False)


@dataclass(frozen=True)
class Show(_OfLibrary):
    """Print the proof of a gait library: violations, residuals, drift, limits."""

    speed: Positional[float | None] = None
    """One gait in detail [m/s]; by default a line for each."""

    def run(self) -> None:
        """Do it."""
        from ..gait import describe_gait, describe_library

        library = self.load()
        if self.speed is None:
            shown_gaits = library if self.apex is None else library.at_apex(self.apex)
            show(describe_library(shown_gaits))
        else:
            robot = robot_of(library, self.robot)
            show(describe_gait(library, self.speed, self.apex, robot=robot))


@dataclass(frozen=True)
class Plot(_OfLibrary):
    """Draw a gait library: joints, torques, forces and trunk over the stride, and a side view."""

    speed: Positional[float | None] = None
    """Speed of the side view [m/s]; by default the one nearest to 0.5."""
    folder: Path = Path("figures")
    """Folder for the figures."""
    format: str = "png"
    """Format of the figures: png, svg or pdf."""

    def run(self) -> None:
        """Do it."""
        from ..viz.figures import write_gait_figures

        library = self.load()
        paths = write_gait_figures(
            library,
            self.folder,
            speed=self.speed,
            apex=self.apex,
            suffix=self.format,
            robot=robot_of(library, self.robot),
        )
        for path in paths:
            print(f"figure  {path}")


@dataclass(frozen=True)
class Gaits:
    """Build, show or plot the gait library."""

    action: (
        Annotated[Build, subcommand("build")]
        | Annotated[Show, subcommand("show")]
        | Annotated[Plot, subcommand("plot")]
    )

    def run(self) -> None:
        """Do it."""
        self.action.run()


def open_library(
    path: Path | None, robot: str, gait: str, base: str | None, *, audited: bool = True
) -> GaitLibrary:
    """A library from a file, or one that is shipped."""
    from ..gait import GaitLibrary, known_base, load_library
    from ..robot import load_robot

    machine = load_robot(robot)
    if path is None:
        return load_library(
            machine.name, gait=gait, base=None if base is None else known_base(base)
        )
    library = GaitLibrary.load(path, audited=audited)
    if library.robot == machine.name:
        library = GaitLibrary.load(path, robot=machine, audited=audited)
    return library


def robot_of(library: GaitLibrary, robot: str) -> Robot:
    """The robot of a library: the one that is named, if it is, or the one known by its name.

    Raises:
        InvalidInput: It is neither.
    """
    from ..errors import InvalidInput, UnknownName
    from ..robot import load_robot, load_robot_spec

    spec = load_robot_spec(robot)
    if spec.name == library.robot:
        return load_robot(spec)
    try:
        return load_robot(library.robot)
    except UnknownName as error:
        raise InvalidInput(
            f"these are gaits of {library.robot}, which is no robot that is known by name; give "
            "its file, --robot FILE.toml"
        ) from error
