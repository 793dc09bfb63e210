"""What objects print fits on a screen, and is a table in notebooks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from pronk_pin import load_robot
from pronk_pin._display import fit
from pronk_pin.compare import Experiment, Results, Scenario, random_scenarios
from pronk_pin.control import CONTROLLERS, ControllerSpec, TorqueLibrary
from pronk_pin.gait import load_library
from pronk_pin.robot import ModelParameters

LINES, COLUMNS = 25, 100

LIBRARY = load_library("a1")
LARGE = Experiment(
    gaits=LIBRARY,
    controllers=tuple(replace(CONTROLLERS["ilc"], name=f"mine-{k}") for k in range(100)),
    scenarios=(*random_scenarios(100, 0), Scenario("hot")),
    seeds=tuple(range(300)),
)
SHOWN = {
    "library": LIBRARY,
    "gait": LIBRARY.gaits[0],
    "phase": LIBRARY.gaits[0].phases[1],
    "audit": LIBRARY.audit[0],
    "robot": load_robot("a1").with_parameters(ModelParameters(armature=(0.01,) * 3)),
    "torques": TorqueLibrary(np.arange(2.0), *np.ones((2, 2, 2, 161, 12)), np.ones(2)),
    "experiment": LARGE,
    "results": Results(Path("results/<i>&\"mine'"), replace(LARGE, seeds=(0,))),
}


@pytest.mark.parametrize("name", SHOWN)
def test_what_is_printed_fits_on_a_screen(name: str) -> None:
    lines = repr(SHOWN[name]).splitlines()
    assert len(lines) <= LINES
    assert max(map(len, lines)) <= COLUMNS
    assert len(lines) > 1


@pytest.mark.parametrize("name", SHOWN)
def test_notebooks_show_a_table_of_the_same(name: str) -> None:
    text = SHOWN[name]._repr_html_()  # type: ignore[attr-defined]
    table = ElementTree.fromstring(text)  # well formed: everything is escaped
    rows = {row[0].text: row[1].text or "" for row in table.iter("tr")}
    printed = " ".join(repr(SHOWN[name]).split())
    assert rows
    for fact, value in rows.items():
        assert str(fact) in printed
        assert "".join(value.split()) in "".join(printed.split())


def test_what_is_known_of_them_is_shown() -> None:
    assert "-0.5 to 0.8 m/s" in repr(LIBRARY)
    assert "14 from" in repr(LIBRARY)
    assert "all passed" in repr(LIBRARY)
    assert "0.32, 0.34, 0.36 m" in repr(LIBRARY)
    assert "armature (0.01, 0.01, 0.01)" in repr(SHOWN["robot"])
    assert "100: mine-0, mine-1," in repr(LARGE)
    assert "0 of 10100 cells" in repr(SHOWN["results"])


@pytest.mark.parametrize("spec", CONTROLLERS.values(), ids=CONTROLLERS)
def test_a_specification_of_a_controller_fits_on_a_screen(spec: ControllerSpec) -> None:
    assert len(repr(spec)) <= LINES * COLUMNS


TABLE = """\
two joints
                      calf: peak [rad]   thigh: peak [rad]
controller                mean    felt       mean    felt  stayed upright
pd                      0.0988    0.09     0.0905    0.08  14 of 14
my_laws:controller      0.0708    0.05     0.0408    0.02  13 of 14, 1 diverging
                    peaks from the true contact on; felt from when the controller felt it"""


@pytest.mark.parametrize("width", [41, 50, 60, 76])
def test_a_table_that_is_too_wide_goes_on_below_with_its_first_column_again(width: int) -> None:
    text = fit(TABLE, width)
    assert max(map(len, text.splitlines())) <= width
    parts = text.split("\n\n")
    assert len(parts) == (3 if width < 60 else 2)
    for part in parts:
        assert [line.split()[0] for line in part.splitlines() if "_laws" in line or "pd" in line]
    words = [
        word for word in text.split() if word not in ("controller", "pd", "my_laws:controller")
    ]
    names = {"controller", "pd", "my_laws:controller"}
    assert sorted(words) == sorted(word for word in TABLE.split() if word not in names)
    for cell in ("calf: peak [rad]", "thigh: peak [rad]", "13 of 14, 1 diverging"):
        assert cell in text


def test_what_fits_or_goes_to_no_screen_stays_as_it_is() -> None:
    assert fit(TABLE, 95) == TABLE
    assert fit(TABLE, None) == TABLE


def test_paragraphs_are_filled_again_and_lists_hang() -> None:
    wide = "word " * 19 + "word\n" + "more " * 4
    filled = ["word " * 15 + "word", "word " * 4 + "more " * 3 + "more"]
    assert fit(wide, 80).splitlines() == filled
    listed = "name  " + "says " * 20 + "\nother  short"
    first, second, last = fit(listed, 80).splitlines()
    assert (first[:10], second[:12], last) == ("name  says", "      says s", "other  short")
