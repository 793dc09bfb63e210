"""Scenes as one HTML file that plays by itself, from disk and without a network."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from pathlib import Path
from string import Template

from ..._checks import Interval, real
from ..._checks import path as known_path
from ...errors import InvalidInput
from ...storage import write_file
from ..scenes import Choice, Menu, Scene
from .page import page, player_source, script_json, viewer_source
from .scene_encoding import FPS, film_blob, robot_blob

RATE = Interval(0, 1000, above=True)
"""Frames for each second."""

LARGEST = 4_900_000
"""Size that a file keeps below [bytes], unless its first film alone is larger."""

_START = """\
<script>
  const films = $films;
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  let player;
  Player.start({
    robot: bytes("$robot"), options: $options, first: $first,
    held: Object.keys(films).map((key) => JSON.parse(key)),
    film: async (choice) => {
      const text = films[JSON.stringify(Object.values(choice))];
      if (!text) throw new Error("This choice is not in the file.");
      return bytes(text);
    },
  }).then((started) => { player = started; });
</script>
"""


def write_replay(shown: Scene | Menu, path: Path | str, *, fps: float = FPS) -> Path:
    """Write a scene, or several to choose from, as one HTML file that plays at once and repeats.

    Of a menu the file holds `Menu.choices`, as far as it stays below `LARGEST`; without
    those of which there is nothing to show.

    The page has the controls of the live page; with `#t=0.35` behind its address it opens paused
    0.35 s after the scene's beginning.

    Args:
        shown: What to show.
        path: The file; its folder is created.
        fps: Frames that are stored for each second; the page interpolates between them.

    Returns:
        The path.

    Raises:
        FileProblem: The file cannot be written.
        InvalidInput: fps is not in `RATE`.
    """
    path = known_path("path", path)
    return write_file(path, replay_html(shown, fps=fps), remedy="choose another path")


def replay_html(shown: Scene | Menu, *, fps: float = FPS) -> str:
    """The text of the file that `write_replay` writes."""
    fps = real("fps", fps, RATE)
    menu = Menu.of(shown)
    first = menu.scene()
    frame = page(
        first.title,
        f"<script>{viewer_source()}</script>\n<script>{player_source()}</script>\n$start",
    )
    robot = _text(robot_blob(first))
    films: dict[str, str] = {}
    held: list[Choice] = []
    size = len(frame.encode()) + len(robot) + 2_000
    for choice in menu.choices():
        try:
            scene = menu.scene(choice)
        except InvalidInput:
            if not films:
                raise
            continue  # as strides before the learning of who learned from the first on
        text = _text(film_blob(scene, fps=fps))
        if films and size + len(text) > LARGEST:
            break
        size += len(text) + 100
        films[json.dumps([*choice.values()], separators=(",", ":"))] = text
        held.append(choice)
    start = Template(_START).substitute(
        robot=robot,
        films=script_json(films),
        options=script_json(_options(menu, held)),
        first=script_json(dict(menu.first)),
    )
    return frame.replace("$start", start, 1)


def _options(menu: Menu, held: Sequence[Choice]) -> dict[str, list[str]]:
    """The values of each option that the file holds, in the menu's order."""
    return {
        name: [value for value in values if any(choice[name] == value for choice in held)]
        for name, values in menu.options.items()
    }


def _text(blob: bytes) -> str:
    return base64.b64encode(blob).decode("ascii")
