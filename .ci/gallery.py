"""Pages of the site that are made by running something: examples with their pictures, notebooks.

What was made is kept in `.cache/` as long as the file and the package are the same.
"""

from __future__ import annotations

import ast
import base64
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted(path for path in (ROOT / "examples").glob("*.py") if path.stem != "dart_engine")
"""Those that need nothing more than the package."""
NOTEBOOKS = sorted((ROOT / "examples" / "notebooks").glob("*.py"))
PICTURE = "picture.svg"
"""File in the results folder that an example draws."""

Pages = dict[str, bytes]
"""Contents of files by their paths on the site."""


def pages() -> Pages:
    """All pages that are made, and the pictures in them."""
    made: Pages = {}
    parts = [
        "# Gallery\n\nEach example is a file that runs by itself, in less than a minute: `python "
        "examples/own_law.py`. The pictures are what they draw, made when this site was built."
    ]
    for path in EXAMPLES:
        title, _, rest = (ast.get_docstring(ast.parse(path.read_text())) or "").partition("\n\n")
        kept = _kept(path, _picture)
        made[f"gallery/{path.stem}.svg"] = kept["picture"]
        parts.append(
            f"## {path.stem.replace('_', ' ')}\n\n{title.split(': `python')[0]}. {rest}\n\n"
            f"![{path.stem}](gallery/{path.stem}.svg)\n\n"
            f"[examples/{path.name}](../examples/{path.name}) prints\n\n```\n"
            f"{kept['printed'].decode().strip()}\n```"
        )
    made["gallery.md"] = "\n\n".join(parts).encode()
    for path in NOTEBOOKS:
        made.update({f"notebooks/{name}": data for name, data in _kept(path, _executed).items()})
    return made


def _kept(path: Path, make: Any) -> Pages:
    """What is made of a file, from the cache if nothing has changed."""
    key = hashlib.sha256(path.read_bytes() + _package()).hexdigest()[:20]
    file = ROOT / ".cache" / f"{path.stem}-{key}.json"
    if not file.exists():
        made = {name: base64.b64encode(data).decode() for name, data in make(path).items()}
        file.parent.mkdir(exist_ok=True)
        file.write_text(json.dumps(made))
    return {name: base64.b64decode(data) for name, data in json.loads(file.read_text()).items()}


@lru_cache
def _package() -> bytes:
    files = [*(ROOT / "pronk_pin").rglob("*.py"), Path(__file__)]
    return b"".join(hashlib.sha256(path.read_bytes()).digest() for path in sorted(files))


def _picture(path: Path) -> Pages:
    """What an example draws and prints."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, path, "result"],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise RuntimeError(f"{path.name} fails:\n{done.stderr[-2000:]}")
        picture = (Path(folder) / "result" / PICTURE).read_bytes()
    return {"picture": picture, "printed": done.stdout.encode()}


def _executed(path: Path) -> Pages:
    """A notebook, run, as Markdown with its pictures, and as `.ipynb`."""
    import jupytext
    import nbformat
    from nbclient import NotebookClient

    notebook = jupytext.read(path)
    with tempfile.TemporaryDirectory() as folder:
        os.environ["PYTHONPATH"] = str(ROOT)
        resources = {"metadata": {"path": folder}}
        NotebookClient(notebook, timeout=900, resources=resources).execute()
    made: Pages = {f"{path.stem}.ipynb": nbformat.writes(notebook).encode()}
    parts: list[str] = []
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source)
            continue
        parts.append(f"```python\n{cell.source}\n```")
        for output in cell.outputs:
            drawn = output.get("data", {}).get("image/svg+xml")
            if drawn is not None:
                name = f"{path.stem}-{len(made)}.svg"
                made[name] = "".join(drawn).encode()
                parts.append(f"![figure]({name})")
            elif output.get("name") == "stdout":
                parts.append(f"```text\n{output.text.rstrip()}\n```")
    parts.append(f"[The notebook]({path.stem}.ipynb), with what it printed and drew.")
    made[f"{path.stem}.md"] = "\n\n".join(parts).encode()
    return made
