"""Pictures, animations and films of a scene, without a display: the page, drawn by a browser."""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from tqdm import tqdm

from ..._checks import NOT_NEGATIVE, POSITIVE, flag, none_or, real, text, whole
from ...errors import FileProblem, InvalidInput, cannot_write
from ...storage import partial_path, temporary_folder, write_file
from ..scenes import Scene
from .browser import Browser
from .replay import RATE, write_replay


@dataclass(frozen=True)
class Film:
    """Size, rate and time of pictures and films.

    Attributes:
        width: Width of the picture [pixels].
        height: Height of the picture [pixels].
        plots: Show the plots of error and torque beside the robots.
        color: Colour the links by "error", "torque", or "" for as they are.
        fps: Frames for each second of the film.
        rate: Seconds of the scene for each second of the film; below 1 for slow motion.
        at: Time at which the film begins, or of the picture, from the scene's beginning [s].
        seconds: How much of the scene the film shows [s]; by default to its end.
    """

    width: int = 800
    height: int = 600
    plots: bool = False
    color: str = ""
    fps: float = 25.0
    rate: float = 1.0
    at: float = 0.0
    seconds: float | None = None

    def __post_init__(self) -> None:
        flag("plots", self.plots)
        real("fps", self.fps, RATE), real("rate", self.rate, RATE)
        for name in ("width", "height"):
            if not 64 <= whole(name, getattr(self, name)) <= 4096 or getattr(self, name) % 2:
                raise InvalidInput(
                    f"{name}={getattr(self, name)}; give an even number of pixels from 64 to 4096"
                )
        if text("color", self.color) not in ("", "error", "torque"):
            raise InvalidInput(f"color='{self.color}'; choose error or torque, or leave it out")
        real("at", self.at, NOT_NEGATIVE), none_or(real, "seconds", self.seconds, POSITIVE)

    def times(self, duration: float) -> list[float]:
        """The instants of the film of a scene of that duration [s], from its beginning."""
        remaining = max(duration - self.at, 0.0)
        shown = remaining if self.seconds is None else min(self.seconds, remaining)
        count = max(int(shown / self.rate * self.fps + 1e-9), 1)
        return [self.at + k * self.rate / self.fps for k in range(count)]


def write_png(scene: Scene, path: Path | str, film: Film | None = None) -> Path:
    """Write a picture of a scene at `film.at`, as PNG.

    Raises:
        NoBrowser: There is none to draw it.
        FileProblem: The file cannot be written.
    """
    film = Film() if film is None else film
    path = _writable(path)
    with _stage(scene, film) as picture:
        write_file(path, picture(film.at))
    return path


def write_film(
    scene: Scene, path: Path | str, film: Film | None = None, *, progress: bool = True
) -> Path:
    """Write a film of a scene, as GIF or MP4 by the name of the file.

    Args:
        scene: The scene.
        path: The file; its folder is made.
        film: What the film is like.
        progress: Show a progress bar.

    Raises:
        NoBrowser: There is none to draw it.
        InvalidInput: The file is neither a GIF nor an MP4, or there is no encoder for MP4.
        FileProblem: The file cannot be written.
    """
    film = Film() if film is None else film
    path = _writable(path)
    if path.suffix not in (".gif", ".mp4"):
        raise InvalidInput(f"films are written as .gif or .mp4, not as '{path.name}'")
    if path.suffix == ".mp4":
        _encoder()
    with _stage(scene, film) as picture:
        times = tqdm(
            film.times(scene.duration), desc="drawing", unit=" frames", disable=not progress
        )
        pictures = (Image.open(io.BytesIO(picture(time))).convert("RGB") for time in times)
        (_write_gif if path.suffix == ".gif" else _write_mp4)(path, pictures, film)
    return path


@contextlib.contextmanager
def _stage(scene: Scene, film: Film) -> Iterator[Callable[[float], bytes]]:
    """A scene's page in a browser, made for pictures: the page at a time [s] as PNG."""
    with contextlib.ExitStack() as resources:
        # As many frames as the film shows; between them the page interpolates.
        page = resources.enter_context(temporary_folder()) / "page.html"
        write_replay(scene, page, fps=max(60.0, film.fps / film.rate))
        browser = resources.enter_context(Browser(film.width, film.height))
        browser.open(f"{page.as_uri()}#t={film.at}")
        kind = "film plots" if film.plots else "film"
        browser.run(
            f"document.body.className = '{kind}'; player.colour('{film.color}'); player.fit()"
        )

        def picture(time: float) -> bytes:
            browser.run(f"player.seek({time})")
            return browser.screenshot()

        yield picture


def _write_gif(path: Path, pictures: Iterator[Image.Image], film: Film) -> None:
    """Write an animation that repeats; its frames last multiples of 10 ms."""
    palette: Image.Image | None = None
    frames = []
    for picture in pictures:
        # One palette for all frames, or still surfaces would flicker.
        palette = picture.quantize(255) if palette is None else palette
        frames.append(picture.quantize(palette=palette, dither=Image.Dither.NONE))
    buffer = io.BytesIO()
    duration = max(10 * round(100.0 / film.fps), 20)
    options: dict[str, Any] = {"append_images": frames[1:], "duration": duration, "loop": 0}
    frames[0].save(buffer, format="gif", save_all=True, optimize=False, **options)
    write_file(path, buffer.getvalue())


def _write_mp4(path: Path, pictures: Iterator[Image.Image], film: Film) -> None:
    """Write a video, H.264."""
    with partial_path(path) as partial:
        writer = _encoder().write_frames(
            str(partial), (film.width, film.height), fps=film.fps, quality=7, macro_block_size=2
        )
        try:
            writer.send(None)
            for picture in pictures:
                writer.send(np.ascontiguousarray(picture))
        finally:
            writer.close()


def _encoder() -> Any:
    """The module that brings and drives ffmpeg.

    Raises:
        InvalidInput: It is not installed.
    """
    try:
        import imageio_ffmpeg
    except ImportError as error:
        raise InvalidInput(
            "videos are encoded by imageio-ffmpeg, which is not installed; run "
            "'pip install pronk-pin[video]', or write a .gif"
        ) from error
    return imageio_ffmpeg


def _writable(path: Path | str) -> Path:
    """The path, with its folder made; frames are not drawn for nothing.

    Raises:
        FileProblem: It cannot be written.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(path, error, "choose another path") from error
    if path.is_dir() or not os.access(path if path.exists() else path.parent, os.W_OK):
        raise FileProblem(path, "cannot be written", "choose another path")
    return path
