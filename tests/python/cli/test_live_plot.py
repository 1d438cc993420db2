"""live_plot's parts that need neither ROS nor a screen; tests/nodes/whole/test_live_plot.py sees the window."""

from __future__ import annotations

import numpy as np
import pytest

from xplane_bridge.cli.live_plot import Field, LivePlotError, getter, locate, split
from xplane_bridge.plotting.live import RollingSeries


class Vector:
    __slots__ = ["x", "y"]
    _type = "pkg/Vector"

    def __init__(self) -> None:
        self.x = self.y = 0.0


class Message:
    __slots__ = ["many", "name", "speeds", "vector"]
    _type = "pkg/Message"

    def __init__(self) -> None:
        self.vector = Vector()
        self.speeds = [0.0] * 3
        self.many = []
        self.name = ""


def test_commas_share_the_parent() -> None:
    assert split("/a/b/x,y,/c/z") == ["/a/b/x", "/a/b/y", "/c/z"]
    assert split("/a/b/x") == ["/a/b/x"]


def test_the_longest_topic_wins() -> None:
    assert locate("/a/b/x", ["/a", "/a/b", "/ab"]) == Field("/a/b", "x")
    assert locate("/a/b/x/y", ["/a", "/ab"]) == Field("/a", "b/x/y")
    assert locate("/abc/x", ["/ab"]) is None


def test_numbers_are_taken_from_nested_fields_and_elements() -> None:
    message = Message()
    message.vector.y = 2.5
    message.speeds = [1.0, 2.0, 3.0]
    assert getter("vector/y", Message)(message) == 2.5
    assert getter("speeds[2]", Message)(message) == 3.0
    assert np.isnan(getter("many[0]", Message)(message))
    message.many = [7]
    assert getter("many[0]", Message)(message) == 7.0


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("vector/z", "at 'z' there is x, y"),
        ("speed", "there is many, name, speeds, vector"),
        ("name", "name is no number"),
        ("speeds", "speeds is no number"),
        ("vector[0]", "vector is no array"),
        ("vector/x/y", "nothing below it"),
    ],
)
def test_wrong_paths_are_explained(path: str, text: str) -> None:
    with pytest.raises(LivePlotError, match="pkg/Message") as caught:
        getter(path, Message)
    assert text in str(caught.value)


def test_a_series_keeps_its_window_and_begins_anew_when_time_goes_back() -> None:
    series = RollingSeries("a", 10.0)
    for t in range(30):
        series.add(float(t), 2.0 * t)
    times, values = series.arrays()
    np.testing.assert_array_equal(times, np.arange(19, 30))
    np.testing.assert_array_equal(values, 2.0 * np.arange(19, 30))
    series.add(5.0, 1.0)
    assert series.arrays()[0].tolist() == [5.0]
