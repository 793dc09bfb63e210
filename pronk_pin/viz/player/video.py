"""Pictures, animations and films of a scene, without a display: the page, drawn by a browser."""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import subprocess
import tempfile
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
from .browser import Browser, find_browser
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
    check_film(path)
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
    """Write a video, H.264, by the ffmpeg of `find_encoder`."""
    with partial_path(path) as partial, tempfile.TemporaryFile() as log:
        command = [find_encoder(), "-y", "-loglevel", "error", "-f", "rawvideo"]
        command += ["-pix_fmt", "rgb24", "-s", f"{film.width}x{film.height}"]
        command += ["-r", f"{film.fps:g}", "-i", "-", "-an", "-vcodec", "libx264", "-crf", "18"]
        command += ["-pix_fmt", "yuv420p", "-f", "mp4", str(partial)]
        with subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=log
        ) as encoder:
            assert encoder.stdin is not None
            try:
                for picture in pictures:
                    encoder.stdin.write(np.ascontiguousarray(picture).tobytes())
                encoder.stdin.close()
            except BrokenPipeError:
                pass  # what it says is told below
            except BaseException:
                encoder.kill()
                raise
            failed = encoder.wait() != 0
        if failed:
            log.seek(0)
            said = " ".join(log.read().decode(errors="replace").split())
            raise InvalidInput(f"{command[0]} cannot encode H.264 ({said}); write a .gif")


def find_encoder() -> str:
    """Path of ffmpeg's program: one that is installed, or else that of imageio-ffmpeg.

    Raises:
        InvalidInput: There is none.
    """
    if program := shutil.which("ffmpeg"):
        return program
    try:
        import imageio_ffmpeg
    except ImportError as error:
        raise InvalidInput(
            "videos are encoded by ffmpeg, which is not installed; install it ('apt install "
            "ffmpeg', or 'pip install pronk-pin[video]', which brings its own), or write a .gif"
        ) from error
    return str(imageio_ffmpeg.get_ffmpeg_exe())


def check_film(path: Path | str) -> None:
    """Check that a picture or a film can be made, before anything is computed for it.

    Args:
        path: Its file: .png, .gif or .mp4.

    Raises:
        InvalidInput: It is none of these, or there is no encoder for MP4.
        NoBrowser: There is none to draw it.
    """
    path = Path(path)
    if path.suffix not in (".png", ".gif", ".mp4"):
        raise InvalidInput(f"films are written as .gif or .mp4, not as '{path.name}'")
    if path.suffix == ".mp4":
        find_encoder()
    find_browser()


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
