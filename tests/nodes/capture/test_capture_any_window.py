"""capture.launch alone: an ordinary window of the desktop as images, without X-Plane and without any other node."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Iterator

import numpy as np
import pytest

from support.deadlines import WAIT_S
from support.nodes.late_pictures import joined
from xplane_bridge.harness import ManagedProcess, RosMaster, roslaunch, wait_until
from xplane_bridge.harness.display import VirtualDisplay
from xplane_bridge.harness.ports import free_tcp_port

TITLE = "Field notes - page 7"
#: Two halves, and each half of the other's colour a moment later. 400x300 is of the shape of 640x480.
WINDOW = """
import tkinter
root = tkinter.Tk()
root.title("{title}")
canvas = tkinter.Canvas(root, width=400, height=300, highlightthickness=0)
canvas.pack()
halves = [canvas.create_rectangle(x, 0, x + 200, 300, width=0) for x in (0, 200)]
colours = ["#ff8000", "#0040c0"]
def paint():
    for half, colour in zip(halves, colours):
        canvas.itemconfig(half, fill=colour)
    colours.reverse()
    root.after(100, paint)
paint()
root.mainloop()
"""
#: What the diagnosis says where reading a picture takes long, as on a busy machine.
SLOW = re.compile(r"reading a picture takes (\d+\.\d) ms")
ORANGE, BLUE = (0x00, 0x80, 0xFF), (0xC0, 0x40, 0x00)  # BGR


LARGE = """
import tkinter
root = tkinter.Tk()
root.title("large")
canvas = tkinter.Canvas(root, width=4000, height=3000, highlightthickness=0)
canvas.pack()
def paint(number):
    canvas.configure(background=("#ff8000", "#0040c0")[number % 2])
    root.after(100, paint, number + 1)
paint(0)
root.mainloop()
"""


STANDING = """
import tkinter
root = tkinter.Tk()
root.title("standing")
tkinter.Canvas(root, width=400, height=300, highlightthickness=0, background="#ff8000").pack()
root.mainloop()
"""


@pytest.fixture
def display(tmp_path: Path) -> Iterator[str]:
    with VirtualDisplay(tmp_path) as server:
        program = ["env", f"DISPLAY={server.display}", sys.executable, "-c", WINDOW.format(title=TITLE)]
        with ManagedProcess("window", program, tmp_path):
            yield server.display


def test_an_ordinary_window_is_captured(world, master: RosMaster, display: str, tmp_path: Path) -> None:
    from sensor_msgs.msg import CameraInfo, Image
    from xplane_bridge.msg import FrameState

    namespace = f"{world.namespace.lstrip('/')}/desktop"
    nowhere = {"host": "127.0.0.1", "port": free_tcp_port(), "listen_for_beacon": False}
    args = {"ns": namespace, "window_title": TITLE, "x_display": display, **nowhere}
    with roslaunch(master, tmp_path, "capture.launch", **args) as launch:
        images = world.watch("desktop/camera/image_raw", Image)
        infos = world.watch("desktop/camera/camera_info", CameraInfo)
        states = world.watch("desktop/camera/frame_state", FrameState)
        images.wait_for(what="a picture", timeout=WAIT_S)
        status = world.wait_for_diagnostics(
            "capture", lambda s: (s.level, s.message) == (0, "capturing") or SLOW.fullmatch(s.message)
        )
        assert f'"{TITLE}"' in world.values_of(status)["Source"]
        seen = {halves(image) for image in images.wait_for_count(10)}
        assert seen == {(ORANGE, BLUE), (BLUE, ORANGE)}, "both, and no mixture of them"

        first = images.messages[0]
        assert (first.width, first.height, first.encoding) == (640, 480, "bgr8")
        assert infos.wait_for().K[0] == pytest.approx(554.256, abs=1e-3)  # 320 / tan(30 deg), the parameter's
        unknown, began = FrameState.QUALITY_DISPLAY_UNKNOWN, first.header.stamp  # states may be heard before pictures

        def of_pictures():  # of queues of two a busy machine loses some
            states_of = joined(states, images)
            return [s for s in states_of if not s.quality & unknown and s.header.stamp >= began]

        known = wait_until(of_pictures, WAIT_S, "the state of a picture")[0]
        assert known.quality == (
            FrameState.QUALITY_STATE_MISSING
            | FrameState.QUALITY_VIEW_UNKNOWN
            | FrameState.QUALITY_FOV_ASSUMED
            | FrameState.QUALITY_DELAY_ASSUMED
        )
        assert known.state.valid == 0
        assert np.isnan(known.state.latitude)
        launch.check_running()


def test_a_window_that_stands_is_shown_to_those_who_come_late(world, tmp_path: Path) -> None:
    """As X-Plane does in a pause: nothing is drawn any more when they subscribe."""
    from sensor_msgs.msg import Image
    from xplane_bridge.msg import FrameState

    world.point_to(9)  # nothing answers there
    with VirtualDisplay(tmp_path) as server:
        program = ["env", f"DISPLAY={server.display}", sys.executable, "-c", STANDING]
        with ManagedProcess("window", program, tmp_path):
            world.start("capture_node", {"window": {"display": server.display, "title": "standing"}})
            seen = "Changes of the picture"
            world.wait_for_diagnostics("capture", lambda s: int(world.values_of(s).get(seen, 0)) > 0)
            states = world.watch("camera/frame_state", FrameState)
            images = world.watch("camera/image_raw", Image)
            assert halves(images.wait_for(what="the picture that stands", timeout=WAIT_S)) == (ORANGE, ORANGE)
            assert states.wait_for(timeout=WAIT_S).quality & FrameState.QUALITY_DISPLAY_UNKNOWN


def test_pictures_that_take_long_to_read_are_a_warning(world, tmp_path: Path) -> None:
    from sensor_msgs.msg import CameraInfo

    world.point_to(9)  # nothing answers there
    with VirtualDisplay(tmp_path, 4000, 3000) as server:
        program = ["env", f"DISPLAY={server.display}", sys.executable, "-c", LARGE]
        with ManagedProcess("window", program, tmp_path):
            # 48 MB a picture, through a socket.
            window = {"display": server.display, "title": "large", "shared_memory": False}
            world.start("capture_node", {"window": window})
            world.watch("camera/camera_info", CameraInfo)
            status = world.wait_for_diagnostics("capture", lambda s: SLOW.fullmatch(s.message), timeout=60.0)
    assert status.level == 1
    assert float(SLOW.fullmatch(status.message).group(1)) > 5.0


def halves(image) -> tuple:
    """The colours of the left and of the right half, each the same all over it; else what there is of them."""
    picture = np.frombuffer(image.data, np.uint8).reshape(image.height, image.width, 3)
    # Both edges of the middle are blurred by scaling.
    return tuple(single_colour(part) for part in (picture[:, :315], picture[:, 325:]))


def single_colour(part: np.ndarray) -> tuple:
    low, high = part.min(axis=(0, 1)), part.max(axis=(0, 1))
    return tuple(int(v) for v in low) if np.array_equal(low, high) else (tuple(low), tuple(high))
