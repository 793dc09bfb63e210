"""What is packed for the page comes out again, to the resolution that is promised."""

from __future__ import annotations

import json
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pronk_pin.viz import Scene
from pronk_pin.viz.player.packing import pack
from pronk_pin.viz.player.scene_encoding import film_blob, robot_blob, stream_row


def unpack(blob: bytes) -> Any:
    """The document of a blob, read as `packing` describes it."""
    data = zlib.decompress(blob)
    length = int.from_bytes(data[:4], "little")
    text, rest = data[4 : 4 + length], data[4 + length :]
    return json.loads(text, object_hook=lambda entry: read(entry, rest) if "$" in entry else entry)


def read(entry: dict[str, Any], data: bytes) -> np.ndarray:
    count = int(np.prod(entry["shape"]))
    data = data[entry["at"] :]
    if entry["$"] == "u4":
        return np.frombuffer(data[: 4 * count], "<u4").reshape(entry["shape"])
    low, high = (np.frombuffer(data[k * count : (k + 1) * count], "u1") for k in (0, 1))
    steps = (low.astype(int) + 256 * high.astype(int)).reshape(len(entry["low"]), -1).T
    whole = np.cumsum(steps, axis=0) % 65536
    values = np.array(entry["low"]) + np.array(entry["step"]) * whole
    return np.where(whole == 65535, np.nan, values).reshape(entry["shape"])


@settings(max_examples=50, deadline=None)
@given(arrays(float, (7, 3), elements=st.floats(-1e3, 1e3) | st.just(np.nan)))
def test_numbers_keep_a_65534th_of_their_columns_range(table: np.ndarray) -> None:
    (found,) = unpack(pack([table]))
    np.testing.assert_array_equal(np.isnan(found), np.isnan(table))
    for column, original in zip(found.T, table.T, strict=True):
        known = original[~np.isnan(original)]
        if known.size:
            step = np.ptp(known) / 65534
            np.testing.assert_allclose(column[~np.isnan(column)], known, atol=0.51 * step + 1e-12)


def test_texts_and_indices_stay_as_they_are() -> None:
    faces = np.array([[0, 70000, 2], [3, 4, 5]])
    found = unpack(pack({"a": ["<ä>", 1.5, None, True], "faces": faces}))
    assert found["a"] == ["<ä>", 1.5, None, True]
    np.testing.assert_array_equal(found["faces"], faces)


def test_a_film_holds_the_scene(scene: Scene) -> None:
    film = unpack(film_blob(scene, fps=50.0))
    times = scene.times(50.0)
    for told, track, row in zip(film["tracks"], scene.tracks, scene.rows(times), strict=True):
        assert told["name"] == track.name
        np.testing.assert_allclose(told["q"], row["q"], atol=5e-5)
        np.testing.assert_allclose(told["feet"], row["feet"], atol=5e-5)
        for name in track.channels:
            np.testing.assert_allclose(told[name], row[name], atol=1e-3)
    assert film["tracks"][0]["marks"][3] == [pytest.approx(0.6), 1, "flight"]
    assert film["errorScale"] == 0.05
    # The greatest of the torques is 10 of 33.5 N m.
    assert film["useScale"] == 0.3


def test_a_shape_that_several_parts_share_is_there_once(scene: Scene) -> None:
    robot = unpack(robot_blob(scene))
    assert len({part["shape"] for part in robot["parts"]}) == len(robot["shapes"]) < 17
    extent = np.ptp(robot["shapes"][robot["parts"][0]["shape"]]["vertices"], axis=0)
    assert extent.max() < 0.5


def test_an_instant_of_the_stream_is_a_row_of_floats(scene: Scene) -> None:
    values = np.frombuffer(stream_row(scene, 0.12), "<f4")
    # The view; q, feet, forces, error and torque of the robot; q and feet of the reference.
    assert len(values) == 2 + (19 + 12 + 12 + 12 + 12) + (19 + 12)
    robot = scene.tracks[0].at(np.array([0.12]))
    np.testing.assert_allclose(values[2:21], robot["q"][0], atol=1e-6)
    np.testing.assert_allclose(values[33:45], robot["forces"][0], atol=1e-4)
