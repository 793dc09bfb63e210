"""Who waits is told that work goes on."""

from __future__ import annotations

import time

import pytest

from pronk_pin._workers import count_steps
from pronk_pin.cli import progress as progress_module
from pronk_pin.cli.progress import progress


def test_what_takes_long_says_so_and_counts_what_is_simulated(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress_module, "PATIENCE", 0.05)
    with progress("learning"):
        count_steps(2500)
        time.sleep(0.3)
    assert "learning: 00:00, 2.50k robot-steps" in capsys.readouterr().err
    count_steps(9000)  # nobody listens any more
    with progress("explaining", counted=False):
        time.sleep(0.3)
    said = capsys.readouterr().err
    assert "explaining: 00:00" in said
    assert "steps" not in said


def test_what_is_done_at_once_is_not_worth_a_word(capsys: pytest.CaptureFixture[str]) -> None:
    with progress("learning"):
        count_steps(2500)
    assert "learning" not in capsys.readouterr().err
