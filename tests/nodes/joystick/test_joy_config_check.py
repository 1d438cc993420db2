"""joy_config_check with real messages and the real mapper: once, live on a terminal, and a file for a new device."""

from __future__ import annotations

import os
import pty
import re
import signal
import subprocess
import sys

import pytest

from support.deadlines import WAIT_S
from xplane_bridge.harness import wait_until
from xplane_bridge.resources import program

FILE = """
device: Pad
direct:
  roll: {axis: 0, scale: -1.0}
integrated:
  flaps: {axis: 1, rate: 0.5, dead_zone: 0.0}
mode: {auto: 1}
"""


@pytest.fixture
def stick(world):
    """A joystick that repeats what it shows; its axes and buttons may be changed."""
    import rospy
    from sensor_msgs.msg import Joy

    message = Joy(axes=[-0.25, 0.0, 0.5], buttons=[1, 0])
    message.header.frame_id = "Pad of mine"
    publisher = rospy.Publisher(f"{world.namespace}/joy", Joy, queue_size=1)
    timer = rospy.Timer(rospy.Duration(0.02), lambda _: publisher.publish(message))
    yield message
    timer.shutdown()
    timer.join()


def check(world, *options):
    command = [sys.executable, str(program("joy_config_check")), *map(str, options), "--namespace", world.namespace]
    return subprocess.run(command, env=world.env, capture_output=True, text=True, timeout=60, check=False)


def test_once_it_shows_what_the_mapper_makes_of_the_stick(world, stick):
    from xplane_bridge.msg import ControlCommand

    assert stick.axes
    commands = world.watch("control/manual", ControlCommand)
    done = check(world, "logitech_extreme_3d_pro", "--once")
    # Its hats, axes 4 and 5, are not there.
    assert done.returncode == 1, done.stderr
    assert "'Pad of mine': 3 axes, 2 buttons" in done.stdout
    assert re.search(r"ERROR: .*axis 5 \(integrated\.flaps\.axis\) does not exist", done.stdout)
    (world.folder / "pad.yaml").write_text(FILE, encoding="utf-8")
    done = check(world, world.folder / "pad.yaml", "--once")
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"^ +0 +-0\.250 .* roll \+0\.250 +roll \[direct\.roll\]$", done.stdout, re.MULTILINE)
    assert re.search(r"^ +2 +\+0\.500 .*- not mapped -$", done.stdout, re.MULTILINE)
    assert re.search(r"^ +0 +pressed +- not mapped -$", done.stdout, re.MULTILINE)
    assert not commands.messages, "it commands nothing"


def test_what_is_wrong_in_the_file_is_said_in_the_mappers_words(world, stick):
    assert stick.axes
    (world.folder / "pad.yaml").write_text(FILE.replace("scale: -1.0", "scale: -1.0, expo: 3"), encoding="utf-8")
    done = check(world, world.folder / "pad.yaml", "--once")
    assert done.returncode == 1
    assert re.search(r"ERROR: parameter direct\.roll\.expo is 3", done.stdout), done.stdout


def test_without_a_joystick_it_says_how_to_start_one(world):
    done = check(world, "xbox", "--once", "--timeout", "0.5")
    assert done.returncode == 1
    assert "nothing on" in done.stderr
    assert "driver:=sdl" in done.stderr


def test_a_file_for_a_new_device_is_written_and_flies(world, stick):
    assert stick.axes
    new = world.folder / "new.yaml"
    assert check(world, "--skeleton", new).returncode == 0
    done = check(world, new, "--once")
    assert done.returncode == 0, done.stdout + done.stderr
    # (0.25 - 0.05) / 0.95 = 0.2105 to the right; 0.7 * 0.2105 + 0.3 * 0.2105^3
    assert "roll +0.150" in done.stdout
    again = check(world, "--skeleton", new)
    assert again.returncode == 1
    assert "exists" in again.stderr


def test_on_a_terminal_it_follows_the_stick_and_the_file(world, stick):
    file = world.folder / "pad.yaml"
    file.write_text(FILE, encoding="utf-8")
    screen, terminal = pty.openpty()
    command = [sys.executable, str(program("joy_config_check")), str(file), "--namespace", world.namespace]
    run = subprocess.Popen(command, env=world.env, stdin=terminal, stdout=terminal, stderr=terminal)
    os.close(terminal)
    os.set_blocking(screen, False)
    text = ""

    def shows(pattern):
        nonlocal text
        try:
            text += os.read(screen, 65536).decode(errors="replace")
        except (BlockingIOError, OSError):
            return None
        return re.search(pattern, text.rpartition("\x1b[H")[2].replace("\x1b[K", "").replace("\r", ""), re.MULTILINE)

    try:
        wait_until(lambda: shows(r"roll \+0\.250 "), WAIT_S, "command of the stick on the screen")
        stick.axes[0] = 1.0
        stick.axes[1] = 1.0
        stick.buttons[1] = 1
        wait_until(lambda: shows(r"roll -1\.000 "), WAIT_S, "new command on the screen")
        wait_until(lambda: shows(r"flaps \+1\.000 "), WAIT_S, "integrated flaps on the screen")
        wait_until(lambda: shows(r"mode requests: AUTO"), WAIT_S, "request for AUTO on the screen")
        file.write_text(FILE.replace("scale: -1.0", "scale: 0.5"), encoding="utf-8")
        wait_until(lambda: shows(r"roll \+0\.500 "), WAIT_S, "command by the file saved anew")
        file.write_text(FILE.replace("scale", "scal"), encoding="utf-8")
        wait_until(lambda: shows(r"(?s)ERROR: .*direct\.roll\.scal\s"), WAIT_S, "error of the file saved anew")
        file.write_text(f"{FILE}buttons: {{1: {{button: 0}}}}\n", encoding="utf-8")
        wait_until(
            lambda: shows(r"(?s)ERROR: .*buttons\.1\s+is\s+a\s+key\s+that\s+is\s+no\s+text"),
            WAIT_S,
            "key that ROS cannot set",
        )
        file.write_text(f"{FILE}buttons:\n  # none\n", encoding="utf-8")
        wait_until(lambda: shows(r"roll -1\.000 "), WAIT_S, "command by a file with a section of comments only")
        run.send_signal(signal.SIGINT)
        wait_until(lambda: (shows(""), run.poll())[1] is not None, WAIT_S, "end on Ctrl-C")
        assert run.returncode == 130
        shows("")
        assert "\x1b[?25h" in text, "the cursor is given back"
    finally:
        run.kill()
        run.wait()
        os.close(screen)
