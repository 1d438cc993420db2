"""live_plot's parts that need neither ROS nor a screen; tests/nodes/whole/test_live_plot.py sees the window."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Callable

import matplotlib
import numpy as np
import pytest

from xplane_bridge.cli import live_plot
from xplane_bridge.cli.live_plot import Field, LivePlotError, getter, locate, split
from xplane_bridge.plotting.live import LiveWindow, RollingSeries


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
        ("speeds[3]", "has no field 'speeds[3]': at 'speeds[3]' there is speeds[0] to speeds[2]"),
        ("vector/x/y", "nothing below it"),
    ],
)
def test_wrong_paths_are_explained(path: str, text: str) -> None:
    with pytest.raises(LivePlotError, match="pkg/Message") as caught:
        getter(path, Message)
    assert text in str(caught.value)


def test_a_topic_without_a_field_is_explained_as_soon_as_it_is_seen(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    published = [[["/other", "pkg/Other"]], [["/other", "pkg/Other"], ["/a/b", "pkg/Message"]]]
    node = SimpleNamespace(
        resolve_name=lambda name: name,
        signal_shutdown=lambda _why: None,
        get_published_topics=lambda: published.pop(0),
    )
    built: dict = {"pkg/Message": Message}
    roslib = SimpleNamespace(message=SimpleNamespace(get_message_class=built.get))
    for name, module in (("rospy", node), ("roslib", roslib), ("roslib.message", roslib.message)):
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(live_plot, "start_node", lambda *_args, **_options: node)
    matplotlib.use("Agg")
    assert live_plot.main(["/a/b", "--after", "1"]) == 1
    said = capsys.readouterr().err
    assert said.endswith(
        "/a/b is a topic (pkg/Message): name a field of it, e.g. /a/b/speeds[0]; it has: many, name, speeds, vector\n"
    )
    published[:] = [[["/other", "pkg/Other"]]]
    assert live_plot.main(["/other", "--after", "1"]) == 1
    assert capsys.readouterr().err.endswith("/other is a topic: name a field of it, e.g. /other/x\n")


def test_a_series_keeps_its_window_and_begins_anew_when_time_goes_back() -> None:
    series = RollingSeries("a", 10.0)
    for t in range(30):
        series.add(float(t), 2.0 * t)
    times, values = series.arrays()
    np.testing.assert_array_equal(times, np.arange(19, 30))
    np.testing.assert_array_equal(values, 2.0 * np.arange(19, 30))
    series.add(5.0, 1.0)
    assert series.arrays()[0].tolist() == [5.0]


def test_a_restart_that_sets_the_clock_back_is_shown_while_another_topic_is_silent(tmp_path: Path) -> None:
    matplotlib.use("Agg")
    flown, silent = RollingSeries("roll", 60.0), RollingSeries("wind", 60.0)
    window = LiveWindow([("a", [flown]), ("b", [silent])], 60.0, tmp_path / "x.png")
    for t in (5000.0, 5001.0):
        flown.add(t, 1.0)
        silent.add(t, 2.0)
    for t in (0.0, 1.0, 2.0):
        flown.add(t, 1.0)
    window.refresh()
    (roll,), (wind,) = window._lines
    assert roll.get_xdata().tolist() == [-2.0, -1.0, 0.0]
    assert wind.get_xdata().tolist() == []
    silent.add(2.5, 2.0)
    window.refresh()
    assert (roll.get_xdata()[-1], wind.get_xdata().tolist()) == (-0.5, [0.0])


def plot_for_a_moment(monkeypatch: pytest.MonkeyPatch, png: Path, meanwhile: Callable[[], None]) -> int:
    """Runs `live_plot --after`, for which a topic is there; `meanwhile` is called once it is found."""

    def wait_for(names: Any, _timeout: float) -> dict:
        meanwhile()
        return dict.fromkeys(names)

    matplotlib.use("Agg")
    node = SimpleNamespace(resolve_name=lambda name: name, signal_shutdown=lambda _why: None)
    monkeypatch.setattr(live_plot, "start_node", lambda *_args, **_options: node)
    monkeypatch.setattr(live_plot, "_wait_for", wait_for)
    monkeypatch.setattr(live_plot, "_subscribe", lambda _field, _series: None)
    return live_plot.main(["/a/b", "--after", "0.01", "--png", str(png)])


@pytest.mark.parametrize(
    ("name", "text"), [("none/x.png", "there is no folder"), ("x.foo", "expected a file name that ends in one of")]
)
def test_a_file_that_no_picture_can_become_is_refused_at_the_start(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, text: str
) -> None:
    with pytest.raises(SystemExit) as ended:
        plot_for_a_moment(monkeypatch, tmp_path / name, lambda: pytest.fail("it has started"))
    assert ended.value.code == 2
    assert text in capsys.readouterr().err


def test_a_picture_that_cannot_be_written_in_the_end_is_one_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "pictures"
    folder.mkdir()
    png = folder / "x.png"
    assert plot_for_a_moment(monkeypatch, png, lambda: None) == 0
    assert png.stat().st_size > 1000
    png.unlink()
    assert plot_for_a_moment(monkeypatch, png, folder.rmdir) == 1
    said = capsys.readouterr().err
    assert said.endswith(f"{png} is not written: No such file or directory\n")
    assert said.count("\n") == 1


def test_the_s_key_says_when_the_picture_is_not_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    matplotlib.use("Agg")
    png = tmp_path / "none" / "x.png"
    window = LiveWindow([("b", [RollingSeries("b", 10.0)])], 10.0, png)
    press = SimpleNamespace(key="s")
    window._key(press)
    png.parent.mkdir()
    window._key(press)
    said = capsys.readouterr()
    assert said.err == f"{png} is not written: No such file or directory\n"
    assert said.out == f"wrote {png}\n"
