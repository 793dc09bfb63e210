"""What the site has otherwise than the files: the README is its first page, and links out of docs/
lead into the repository."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]


def on_files(files: Any, config: Any) -> Any:
    """Pages that are made by running something: the gallery, and notebooks."""
    from mkdocs.structure.files import File

    spec = importlib.util.spec_from_file_location("gallery", Path(__file__).with_name("gallery.py"))
    assert spec is not None
    assert spec.loader is not None
    gallery = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(gallery)
    for name, content in gallery.pages().items():
        files.append(File.generated(config, name, content=content))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Text of a page before it is rendered."""
    source = page.file.src_uri
    if source == "index.md":
        markdown = (ROOT / "README.md").read_text()
        markdown = re.sub(r"^\[!\[.*\n", "", markdown, flags=re.M)  # badges come from elsewhere
        markdown = markdown.replace("](examples)", "](gallery.md)")
        markdown = markdown.replace("](docs/", "](").replace("](CONTRIBUTING", "](../CONTRIBUTING")
        markdown = markdown.replace("](CITATION", "](../CITATION")
    markdown = re.sub(r"\]\((?:\.\./)+README\.md", "](index.md", markdown)
    return re.sub(r"\]\(\.\./(?=[A-Za-z.])", f"]({config.repo_url}/blob/main/", markdown)
