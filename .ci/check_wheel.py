"""Check what a built wheel holds: our package only, with its data, and importable."""

from __future__ import annotations

import importlib.resources
import sys
import zipfile

import pronk_pin
from pronk_pin.gait import load_library

NEEDED = {
    "pronk_pin/py.typed",
    "pronk_pin/gait/data/a1.npz",
    "pronk_pin/robot/specs/a1.toml",
    "pronk_pin/compare/metrics/data/paper_table1.csv",
    "pronk_pin/viz/player/data/page.html",
    "pronk_pin/viz/lab/data/lab.js",
}


def main(wheel: str) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    top = {name.split("/")[0] for name in names}
    strangers = {name for name in top if name != "pronk_pin" and not name.endswith(".dist-info")}
    if strangers:
        sys.exit(f"the wheel installs {', '.join(sorted(strangers))} beside pronk_pin")
    if missing := NEEDED - names:
        sys.exit(f"the wheel lacks {', '.join(sorted(missing))}")
    with importlib.resources.as_file(importlib.resources.files(pronk_pin)) as path:
        if "site-packages" not in str(path):
            sys.exit(f"pronk_pin was imported from {path}, not from the wheel")
    print(f"{wheel.rsplit('/', 1)[-1]}: {len(names)} files, {len(load_library('a1').gaits)} gaits")


if __name__ == "__main__":
    main(sys.argv[1])
