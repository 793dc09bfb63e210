"""The HTML page that plays films; the same for the live page, the file and pictures."""

from __future__ import annotations

import html
import json
from importlib import resources
from string import Template

from ...storage import REINSTALL, read_text


def page(title: str, script: str) -> str:
    """The page.

    Args:
        title: Its title until the first film is there.
        script: `<script>` elements that load MeshCat's viewer and `player_source`, and start it.
    """
    template = Template(_data("page.html"))
    return template.substitute(title=html.escape(title or "pronk_pin"), script=script)


def viewer_source() -> str:
    """MeshCat's viewer, one JavaScript file."""
    return data_text("meshcat", "viewer/dist/main.min.js")


def player_source() -> str:
    """The player, one JavaScript file."""
    return _data("player.js")


def script_json(value: object) -> str:
    """JSON that may stand in a `<script>`."""
    return json.dumps(value).replace("<", "\\u003c")


def _data(name: str) -> str:
    return data_text(__package__, f"data/{name}")


def data_text(package: str, name: str) -> str:
    """A text file of a package, as it is installed."""
    with resources.as_file(resources.files(package).joinpath(name)) as path:
        return read_text(path, REINSTALL)
