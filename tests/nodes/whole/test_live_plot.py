"""live_plot as a user sees it: a window on a screen, with the curves of live topics in it."""

from __future__ import annotations

import math
import threading
from pathlib import Path
from typing import Iterator

import matplotlib.colors
import matplotlib.image
import numpy as np
import pytest

from xplane_bridge.harness import ManagedProcess, RosMaster
from xplane_bridge.harness.display import VirtualDisplay
from xplane_bridge.plotting.spec import COLOURS
from xplane_bridge.resources import program


@pytest.fixture
def waves(master: RosMaster) -> Iterator[str]:
    """A topic with x = sin, y = cos of its stamp, 50 times a second."""
    import rospy
    from geometry_msgs.msg import Vector3Stamped

    master.check_running()
    publisher = rospy.Publisher("/live_plot_test/waves", Vector3Stamped, queue_size=10)
    ended = threading.Event()

    def publish() -> None:
        while not ended.wait(0.02):
            message = Vector3Stamped()
            message.header.stamp = rospy.Time.now()
            seconds = message.header.stamp.to_sec()
            message.vector.x, message.vector.y = math.sin(seconds), math.cos(seconds)
            publisher.publish(message)

    thread = threading.Thread(target=publish)
    thread.start()
    yield "/live_plot_test/waves"
    ended.set()
    thread.join()
    publisher.unregister()


def test_curves_are_drawn_and_saved(master: RosMaster, waves: str, tmp_path: Path) -> None:
    png = tmp_path / "live.png"
    with VirtualDisplay(tmp_path) as screen:
        command = [program("live_plot"), f"{waves}/vector/x,y", f"{waves}/vector/y", "--window", "5"]
        command += ["--png", png, "--after", "6"]
        plot = ManagedProcess("live_plot", command, tmp_path, env={**master.env, "DISPLAY": screen.display})
        with plot:
            assert plot.wait(90.0) == 0, plot.output()
    image = matplotlib.image.imread(png)[:, :, :3]
    height = image.shape[0]
    counts = []
    for half in (image[: height // 2], image[height // 2 :]):
        for colour in COLOURS[:2]:
            near = np.abs(half - matplotlib.colors.to_rgb(colour)).max(axis=2) < 0.1
            counts.append(int(np.unique(np.nonzero(near)[1]).size))
    # Two curves above, one below, each across a good part of the 1080 px; a legend alone is about 30 px wide.
    assert min(counts[0], counts[1], counts[2]) > 400, counts
    assert counts[3] == 0, counts


def without_display(master: RosMaster) -> dict[str, str]:
    return {key: value for key, value in master.env.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}


def test_without_a_display_it_names_what_works_without_one(master: RosMaster, waves: str, tmp_path: Path) -> None:
    command = [program("live_plot"), f"{waves}/vector/x", "--png", "x.png"]
    plot = ManagedProcess("live_plot", command, tmp_path, env=without_display(master))
    with plot:
        assert plot.wait(60.0) == 1
    said = plot.output()
    assert "no window can be opened here: there is no display (DISPLAY)" in said
    assert "--after S --png x.png" in said
    assert said.count("\n") == 1


def test_without_a_display_it_still_draws_into_a_file(master: RosMaster, waves: str, tmp_path: Path) -> None:
    png = tmp_path / "x.png"
    command = [program("live_plot"), f"{waves}/vector/x", "--window", "5", "--png", png, "--after", "6"]
    plot = ManagedProcess("live_plot", command, tmp_path, env=without_display(master))
    with plot:
        assert plot.wait(90.0) == 0, plot.output()
    image = matplotlib.image.imread(png)[:, :, :3]
    curve = np.abs(image - matplotlib.colors.to_rgb(COLOURS[0])).max(axis=2) < 0.1
    assert np.unique(np.nonzero(curve)[1]).size > 400


def test_an_unknown_topic_is_one_line(master: RosMaster, tmp_path: Path) -> None:
    with VirtualDisplay(tmp_path) as screen:
        command = [program("live_plot"), "/no/such/field", "--wait", "0.5"]
        plot = ManagedProcess("live_plot", command, tmp_path, env={**master.env, "DISPLAY": screen.display})
        with plot:
            assert plot.wait(60.0) == 1
    assert "no topic begins /no/such/field after 0.5 s; published: " in plot.output()
    assert "Traceback" not in plot.output()
