"""The program on computers of other kinds: what it imports, and that it starts without what only Linux has."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from typing import Optional

import pytest

from support.absent_modules import WITHOUT_THEM
from support.deadlines import PROGRAM_S
from xplane_bridge.eye.grab import Grabber, is_xplane
from xplane_bridge.eye.grab_windows import client_area

START = f"""{WITHOUT_THEM}
for module in ("grab_linux", "grab_windows", "grab_macos"):
    importlib.import_module("xplane_bridge.eye." + module)
from xplane_bridge.cli.sight.xplane_eye import main
sys.argv[0] = "xplane_eye"
code = main(sys.argv[1:])
emulator = [name for name in sys.modules if name.startswith("xplane_bridge.emulator")]
assert not emulator, emulator
sys.exit(code)
"""


def run(*arguments: str, display: str = ":9999") -> subprocess.CompletedProcess:
    env = {**os.environ, "DISPLAY": display}
    return subprocess.run(
        [sys.executable, "-c", START, *arguments],
        env=env,
        capture_output=True,
        text=True,
        timeout=PROGRAM_S,
        check=False,
    )


def test_it_starts_without_ros_and_without_what_only_linux_has():
    shown = run("--help")
    assert shown.returncode == 0, shown.stderr
    assert "HOST:PORT" in shown.stdout
    ended = run("127.0.0.1:9")  # goes as far as the display, which is not there
    assert ended.returncode == 1
    assert ended.stderr == (
        "xplane_eye: the display ':9999' (DISPLAY) takes no connection: start xplane_eye on X-Plane's own desktop\n"
    )


def test_a_delay_below_zero_is_taken_as_it_may_be_measured():
    assert "takes no connection" in run("127.0.0.1:9", "--delay", "-0.003").stderr


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["127.0.0.1"], "expected HOST:PORT, e.g. 192.168.1.10:49790"),
        (["127.0.0.1:9", "--delay", "2"], "expected seconds from -0.02 to 0.5"),
        (["127.0.0.1:9", "--delay", "0.1", "--no-calibrate"], "not allowed with"),
        (["127.0.0.1:9", "--quality", "0"], "a whole number from 1 to 100"),
        (["127.0.0.1:9", "--window", "left"], "expected a number from 0 to 255, or a point of the screen X,Y"),
        (["127.0.0.1:9", "--window", "1920,"], "expected a number from 0 to 255, or a point of the screen X,Y"),
    ],
)
def test_wrong_arguments_are_refused_in_words(arguments: list, text: str):
    ended = run(*arguments)
    assert ended.returncode == 2
    assert text in ended.stderr


def test_a_taken_port_is_said():
    from xplane_bridge.eye.rref import FrameStream, RrefError

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("", 0))
        with pytest.raises(RrefError, match=r"another xplane_eye.*--local-port and an --undo-file of its own"):
            FrameStream(("127.0.0.1", 49000), other.getsockname()[1], lambda _: None)


def test_the_title_bar_is_not_in_the_picture():
    # A window composed at (100, 50), 816 x 639; its client area 800 x 600 begins at (108, 81).
    assert client_area((100, 50, 916, 689), (108, 81), (800, 600), (816, 639)) == (8, 31, 808, 631)
    # Full screen: all of it.
    assert client_area((0, 0, 1920, 1080), (0, 0), (1920, 1080), (1920, 1080)) == (0, 0, 1920, 1080)
    # The picture is still of the size before.
    assert client_area((100, 50, 916, 689), (108, 81), (800, 600), (640, 480)) is None


@pytest.mark.parametrize(
    ("path", "is_it"),
    [
        ("C:\\X-Plane 12\\X-Plane.exe", True),
        ("D:/Games/X-Plane 11/X-Plane 11.exe", True),
        ("X-Plane-x86_64", True),
        ("C:\\Program Files\\Firefox\\firefox.exe", False),
        ("C:\\X-Plane 12\\Resources\\browser.exe", False),
        ("", False),
    ],
)
def test_the_window_is_that_of_x_planes_own_process(path: str, is_it: bool):
    assert is_xplane(path) == is_it


class Windows(Grabber):
    """Chooses as the grabbers do."""

    def choose(self, *windows: tuple) -> object:
        return self._chosen([(place, name) for place, name in windows], [name for _, name in windows])


LEFT, BELOW, RIGHT = ((10, 20, 100, 80), "left"), ((10, 300, 200, 160), "below"), ((400, 0, 320, 240), "right")


def test_of_windows_alike_the_number_chooses_from_the_left():
    for number, name in enumerate(("left", "below", "right")):
        windows = Windows((), number, lambda *_: None)
        assert windows.choose(RIGHT, BELOW, LEFT) == name
        assert windows.remark == ""
    largest = Windows((), None, lambda *_: None)
    assert largest.choose(LEFT, RIGHT, BELOW) == "right"
    assert largest.remark == "the window is one of 3 that are alike; --window chooses"
    assert largest.choose(LEFT, RIGHT) == "right"
    assert largest.remark == "the window is one of 2 that are alike; --window chooses"
    assert largest.choose(RIGHT) == "right"
    assert largest.remark == ""
    alone = Windows((), None, lambda *_: None)
    assert alone.choose(LEFT) == "left"
    assert alone.remark == ""
    beyond = Windows((), 3, lambda *_: None)
    assert beyond.choose(LEFT, RIGHT, BELOW) is None
    assert beyond.problem == "there is no window number 3: 3 are alike, counted from 0"


@pytest.mark.parametrize("which", [0, None])
def test_of_windows_alike_none_takes_the_place_of_another(which: Optional[int]):
    windows = Windows((), which, lambda *_: None)
    large = ((0, 0, 900, 600), "large")
    assert windows.choose(large, BELOW) == "large"
    assert windows.choose(BELOW) is None
    assert windows.problem.startswith("the window that was captured is hidden or closed, and another")
    assert windows.choose(((5, 5, 900, 600), "large"), BELOW) == "large"
    assert windows.choose(((0, 0, 900, 600), "opened anew"), BELOW) == "opened anew"


@pytest.mark.parametrize("which", [0, None, (10, 20)])
def test_the_window_that_is_captured_stays_it_when_it_is_moved_or_made_smaller(which: object):
    windows = Windows((), which, lambda *_: None)  # type: ignore[arg-type]
    assert windows.choose(((0, 0, 900, 600), "first"), BELOW) == "first"
    assert windows.choose(((1500, 400, 90, 60), "first"), ((0, 0, 640, 480), "below")) == "first"


def test_of_windows_alike_a_point_of_the_screen_chooses_the_one_there():
    for point, name in (((10, 20), "left"), ((109, 99), "left"), ((209, 459), "below"), ((719, 0), "right")):
        windows = Windows((), point, lambda *_: None)
        assert windows.choose(RIGHT, BELOW, LEFT) == name
        assert windows.remark == ""
    beside = Windows((), (110, 99), lambda *_: None)
    assert beside.choose(LEFT, RIGHT, BELOW) is None
    assert beside.problem == "there is no window at 110,99 of the screen: 3 are alike, none of them there"
