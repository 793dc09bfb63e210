"""The checks of single values: what they take, what they return, and in which words they refuse."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from pronk_pin._checks import LARGEST_SEED, Interval, file_name, real, seed, sequence_of, shown
from pronk_pin._checks import whole as whole_number
from pronk_pin.errors import InvalidInput


@pytest.mark.parametrize(
    ("within", "words"),
    [
        (Interval(0, 100, "kg"), "from 0 to 100 kg"),
        (Interval(0, 2, below=True), "from 0, below 2"),
        (Interval(0, 10, above=True), "above 0, up to 10"),
        (Interval(0, 1, above=True, below=True), "above 0, below 1"),
        (Interval(1), "from 1 on"),
        (Interval(2, unit="m", above=True), "above 2 m"),
        (Interval(high=20, unit="s"), "up to 20 s"),
        (Interval(high=0, below=True), "below 0"),
        (Interval(-0.5, 0.5, "rad"), "from -0.5 to 0.5 rad"),
    ],
)
def test_an_interval_in_words(within: Interval, words: str) -> None:
    assert str(within) == words


def test_the_ends_of_an_interval_belong_to_it_unless_it_says_otherwise() -> None:
    for value in (0.0, 1.0):
        assert value in Interval(0, 1)
        assert value not in Interval(0, 1, above=True, below=True)
    assert float("nan") not in Interval()


@pytest.mark.parametrize(
    "value", [2, 2.0, np.float32(2), np.int64(2), np.array(2), np.array(2.0), Fraction(2)]
)
def test_every_kind_of_real_number_is_a_float_afterwards(value: Any) -> None:
    assert type(real("x", value)) is float
    assert real("x", value) == 2.0


@pytest.mark.parametrize("value", [True, np.True_, "2", None, 2j, [2], np.array([2]), b"2"])
def test_nothing_else_is_a_number(value: Any) -> None:
    for check in (real, whole_number):
        with pytest.raises(InvalidInput, match=r"^x=.* is .*; give a (whole )?number"):
            check("x", value)


def test_a_whole_number_has_no_point() -> None:
    assert whole_number("n", np.int32(3)) == 3
    with pytest.raises(InvalidInput, match=r"n=3\.0 is a float; give a whole number"):
        whole_number("n", 3.0)


def test_an_endless_number_is_refused_without_being_counted() -> None:
    with pytest.raises(InvalidInput, match=r"^x=1000.*\.\.\.; give a number that is finite$"):
        real("x", 10**4000)


def test_a_seed_fits_into_64_bits() -> None:
    assert seed("seed", LARGEST_SEED) == np.int64(LARGEST_SEED)
    with pytest.raises(InvalidInput, match=f"from 0 to {LARGEST_SEED}"):
        seed("seed", LARGEST_SEED + 1)


def test_a_wrong_item_of_a_sequence_is_told_by_its_index() -> None:
    assert sequence_of("x", range(3), real) == (0.0, 1.0, 2.0)
    with pytest.raises(InvalidInput, match=r"^x\[1\]='a' is a str"):
        sequence_of("x", [0.0, "a"], real)


def test_a_long_value_is_shown_in_part_and_in_one_line() -> None:
    assert shown(np.float64(0.5)) == "0.5"
    assert len(shown("x" * 1000)) == 60
    assert "\n" not in shown(np.eye(3))


@pytest.mark.parametrize("name", ["CON/..", "a\0b", " a", "a:b", "a*"])
def test_a_name_of_a_file_holds_nothing_that_means_something_to_a_shell(name: str) -> None:
    with pytest.raises(InvalidInput, match="cannot be part of the name of a file"):
        file_name("name", name)
