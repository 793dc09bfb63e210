"""A scene as one HTML file that plays by itself, from disk and without a network."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from string import Template

from ..errors import InvalidInput, cannot_write
from . import drawing
from .scene import Scene

_START = """\
<script>
  const viewer = createViewer();
  for (const text of $messages) {
    viewer.handle_command_bytearray(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)));
  }
  // A link to a moment: "replay.html#t=0.35" opens paused at 0.35 s.
  const moment = /^#t=([0-9.]+)$$/.exec(location.hash);
  if (moment) {
    viewer.animator.pause();
    viewer.animator.seek(parseFloat(moment[1]));
    viewer.animator.display_progress(parseFloat(moment[1]));
  }
</script>
"""


def write_replay(scene: Scene, path: Path | str, *, fps: float = 60.0) -> Path:
    """Write a scene as one self-contained HTML file, which plays at once and repeats.

    The page's own controls (top right, "Open Controls") pause, scrub and slow it down; with
    `#t=0.35` behind its address it opens paused 0.35 s after the scene's beginning.

    Args:
        scene: What to show.
        path: The file; its folder is created.
        fps: Frames that are stored for each second; the page interpolates between them.

    Returns:
        The path.

    Raises:
        FileProblem: The file cannot be written.
        InvalidInput: fps is not positive.
    """
    path = Path(path)
    if not fps > 0.0:
        raise InvalidInput(f"fps must be positive, not {fps}")
    html = replay_html(scene, fps=fps)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(html, encoding="utf-8")
    except OSError as error:
        raise cannot_write(path, error, "choose another path") from error
    return path


def replay_html(scene: Scene, *, fps: float = 60.0) -> str:
    """The text of the file that `write_replay` writes."""
    messages = [*drawing.setup_messages(scene), drawing.animation_message(scene, fps=fps)]
    texts = json.dumps([base64.b64encode(message).decode("ascii") for message in messages])
    start = Template(_START).substitute(messages=texts)
    return drawing.page(scene, f"<script>{drawing.viewer_source()}</script>\n{start}")
