"""Reports, figures and replays of results from which nothing can be concluded."""

from __future__ import annotations

import json
import re
import shutil
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pronk_pin.compare import Experiment, Results, Schedule, run_experiment
from pronk_pin.control import SKIPPED
from pronk_pin.errors import InvalidInput
from pronk_pin.viz import write_replay
from pronk_pin.viz.report import write_report
from pronk_pin.viz.scenes.stride_scenes import result_menu

EXPERIMENT = Experiment(
    speeds=(0.0, 0.3),
    controllers=("pd", "ilc", "model"),
    scenarios=("nominal", "payload"),
    schedule=Schedule(startup=0.2, baseline=2.0, learning=2.0),
)

Spoil = Callable[[xr.Dataset], xr.Dataset]
Report = Callable[..., dict[str, str]]


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("trouble") / "sound"
    return run_experiment(EXPERIMENT, folder, workers=1, progress=False)


@pytest.fixture
def report(sound: Results, tmp_path: Path) -> Iterator[Report]:
    def write(spoiled: Mapping[str, Spoil], **changed: tuple[str, ...]) -> dict[str, str]:
        """The texts of a report by suffix, with the strides of some cells spoiled.

        Args:
            spoiled: What befalls the cells whose names begin so.
            changed: Attributes of the experiment, which is a part of the sound one.
        """
        folder = shutil.copytree(sound.folder, tmp_path / "spoiled")
        results = Results(folder, replace(sound.experiment, **changed))  # type: ignore[arg-type]
        for cell in results.experiment.cells():
            for begin, befall in spoiled.items():
                if cell.name.startswith(begin):
                    strides = results.strides(cell)
                    results.save(cell, befall(strides).assign_attrs(strides.attrs))
        write_report(results)
        for name in re.findall(r"\]\((figures/[^)]+)\)", (folder / "report.md").read_text()):
            assert (folder / name).stat().st_size > 1000, name
        return {
            "md": (folder / "report.md").read_text(),
            "html": re.sub(r"data:image[^\"]*", "", (folder / "report.html").read_text()),
        }

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield write


def set_to(**changed: float) -> Spoil:
    """Give variables of all finished strides a value."""

    def befall(strides: xr.Dataset) -> xr.Dataset:
        finished = strides["stride"] < strides["count"]
        values = {name: finished.where(finished) * value for name, value in changed.items()}
        return strides.assign({k: v.transpose("speed", "stride") for k, v in values.items()})

    return befall


fall = set_to(upright=0.0)
teach_nothing = set_to(skipped=float(SKIPPED.index("contact lost")))


def lose_errors(strides: xr.Dataset) -> xr.Dataset:
    return strides.assign({n: strides[n] * np.nan for n in ("peak_error", "rms_error")})


def finish_nothing(strides: xr.Dataset) -> xr.Dataset:
    """The first robot finishes no stride."""
    count = strides["count"].to_numpy().copy()
    count[0] = 0
    cut = strides.assign(count=("speed", count))
    finished = cut["stride"] < cut["count"]
    return cut.assign({n: cut[n].where(finished) for n in cut.data_vars if "stride" in cut[n].dims})


def check(texts: dict[str, str], *words: str) -> None:
    for suffix, text in texts.items():
        assert not re.search(r"\b(nan|inf)\b|nan%|inf%", text, re.IGNORECASE), suffix
        for said in words:
            assert said in text, (suffix, said)


ALONE = ("nominal",)


def test_a_report_of_the_fallen_concludes_nothing(report: Report) -> None:
    texts = report({"": fall}, scenarios=ALONE)
    check(
        texts,
        "Nothing is concluded: no robot stayed up under learning and under PD. All 6 robots fell.",
        "Nothing stands beside the paper's Table I: no robot stayed up.",
        "Nothing to show: no robot stayed up that learning taught something.",
        "No robot stayed up: there is no mean error, and no interval, in this result.",
    )
    assert "tracking.svg" not in texts["md"]


@pytest.mark.parametrize(
    ("who", "words"),
    [
        ("pd", "Nothing is concluded: no robot stayed up under PD. 2 robots fell."),
        ("ilc", "Nothing is concluded: no robot stayed up under learning. 2 robots fell."),
        ("model", "nothing is concluded: no robot stayed up under the model's feedforward."),
    ],
)
def test_a_report_names_who_fell(report: Report, who: str, words: str) -> None:
    texts = report({who: fall}, scenarios=ALONE)
    check(texts, words)
    assert ("torques.svg" in texts["md"]) == (who != "ilc")
    assert ("difference.svg" in texts["md"]) == (who == "pd")


def test_a_report_of_a_practice_that_nothing_taught_counts_the_reasons(report: Report) -> None:
    texts = report({"ilc": teach_nothing}, scenarios=ALONE)
    check(texts, "Nothing is concluded: learning learned from none of its", "contact lost). No")
    assert "cuts the mean peak" not in texts["md"]
    assert "torques.svg" not in texts["md"]


def test_a_report_of_strides_without_errors_concludes_nothing(report: Report) -> None:
    texts = report({"ilc": lose_errors}, scenarios=ALONE)
    check(texts, "no robot has an error to compare under both learning and PD")


def test_a_robot_that_finishes_no_stride_is_named(report: Report) -> None:
    check(
        report({"ilc": finish_nothing}, scenarios=ALONE),
        "One robot finished no stride.",
        "In nominal under ilc 1 robot finished no stride.",
    )


def test_a_world_of_the_fallen_is_one_world_less_and_no_more(report: Report) -> None:
    texts = report({"pd_payload": fall, "ilc_payload": fall, "model_payload": fall})
    check(
        texts,
        "In the calf it is better in 0 of 1; open in nominal.",  # two robots prove nothing
        "In payload nothing is concluded: no robot stayed up under learning and under the model",
        "Robots fell: 2 of 2 in payload under ilc",
    )
    assert "heat-map.svg" in texts["md"]


def test_a_suite_of_the_fallen_concludes_nothing(report: Report) -> None:
    check(
        report({"": fall}),
        "In nominal nothing is concluded: no robot stayed up under learning",
        "In payload nothing is concluded: no robot stayed up under learning",
    )


@pytest.mark.parametrize("controllers", [("pd",), ("ilc",), ("model", "ilc"), ("pd", "model")])
def test_a_report_names_what_it_would_need(report: Report, controllers: tuple[str, ...]) -> None:
    missing = " and ".join(name for name in ("pd", "ilc") if name not in controllers)
    texts = report({}, scenarios=ALONE, controllers=controllers)
    check(texts, f"There is no verdict: it takes {missing}, which did not run.")


def test_replays_show_the_fallen_and_leave_out_what_there_is_not(
    sound: Results, tmp_path: Path
) -> None:
    cell = sound.find(controller="ilc")
    strides = sound.strides(cell)

    def spoiled(befall: Spoil) -> Results:
        folder = shutil.copytree(sound.folder, Path(tempfile.mkdtemp(dir=tmp_path)) / "spoiled")
        results = Results(folder, sound.experiment)
        results.save(cell, befall(strides).assign_attrs(strides.attrs))
        return results

    def made(befall: Spoil) -> str:
        results = spoiled(befall)
        page = write_replay(result_menu(results), results.folder / "replay.html")
        return page.read_text()

    assert '"before learning"' in made(fall)
    assert result_menu(spoiled(fall)).scene().caption.endswith("; fell: ILC")
    alone = result_menu(spoiled(fall), beside="nothing").scene()
    assert alone.caption.endswith("; the robot fell")
    assert "fell" not in result_menu(sound).scene().caption
    always = made(set_to(learning=1.0))  # there is nothing before the learning
    assert '"before learning"' not in always
    # Who finished no stride is not shown; the others at that speed are.
    films = json.loads(re.search(r"const films = (\{.*?\});\n", made(finish_nothing), re.DOTALL)[1])  # type: ignore[index]
    shown = {tuple(json.loads(key)[:3]) for key in films}
    assert {("0.3", "ilc", "nominal"), ("0", "pd", "nominal"), ("0", "ilc", "payload")} <= shown
    assert ("0", "ilc", "nominal") not in shown
    with pytest.raises(InvalidInput, match="no stride was finished"):
        made(lambda s: finish_nothing(finish_nothing(s.isel(speed=[1, 0])).isel(speed=[1, 0])))
