"""joy_reader as a node: without a joystick, and with one that only SDL sees, through the mapper to control/manual."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest
import yaml

from support.deadlines import WAIT_S
from xplane_bridge.harness import ManagedProcess
from xplane_bridge.resources import config_file, program

#: The reader in a process whose SDL does what comes line by line in a file: plug, axis I V, button I P, pull.
READER = f"""
import sys, threading, time
from pathlib import Path
sys.path.append({str(Path(__file__).resolve().parents[2])!r})
from xplane_bridge.cli.joy_reader import main
from support.nodes.sdl_device import SdlDevice

def play(file):
    device, done = None, 0
    while True:
        lines = file.read_text().split("\\n")[:-1]
        for line in lines[done:]:
            word, *numbers = line.split()
            if word == "plug":
                device = SdlDevice(axes=6, buttons=12, hats=0)
            else:
                getattr(device, word)(*map(int, numbers))
        done = len(lines)
        time.sleep(0.01)

threading.Thread(target=play, args=(Path(sys.argv[1]),), daemon=True).start()
sys.exit(main(sys.argv[2:]))
"""
ROLL = 1


def start(world, *command):
    process = ManagedProcess("joy_reader", command, world.folder, env=world.env)
    process.start()
    return process


@pytest.fixture
def reader(world):
    """The reader, with the file that moves its device."""
    file = world.folder / "device.txt"
    file.write_text("", encoding="utf-8")

    def do(line):
        with file.open("a", encoding="utf-8") as out:
            out.write(line + "\n")

    process = start(
        world, sys.executable, "-c", READER, file, "--namespace", world.namespace, f"__ns:={world.namespace}"
    )
    yield process, do
    process.stop()


def test_without_a_joystick_it_says_so_and_ends_on_ctrl_c(world):
    process = start(world, program("joy_reader"), "--device", "Extreme", "--namespace", world.namespace)
    try:
        process.wait_for_line("no joystick is there; looking for one", WAIT_S)
        process.send_signal(signal.SIGINT)
        assert process.wait(WAIT_S) == 0, process.output()
    finally:
        process.stop()


def test_stick_to_command_through_unplugging_and_plugging_in(world, reader):
    from sensor_msgs.msg import Joy
    from xplane_bridge.msg import ControlCommand

    process, do = reader
    joy, commands = world.watch("joy", Joy), world.watch("control/manual", ControlCommand)
    options = yaml.safe_load(config_file("joysticks", "logitech_extreme_3d_pro.yaml").read_text(encoding="utf-8"))
    world.start("joystick_mapper_node", {**options, "joy_timeout": 0.3})
    process.wait_for_line("no joystick is there", WAIT_S)
    do("plug")
    first = joy.wait_for()
    assert first.header.frame_id == "Virtual Flight Stick"
    assert first.header.stamp.to_sec() > 1.6e9
    assert list(first.axes) == [0.0] * 6
    assert list(first.buttons) == [0] * 12
    do("axis 0 32767")
    # A motionless stick goes on being heard.
    commands.wait_for(lambda c: c.fields & ROLL and c.roll == 1.0, what="roll right of a stick moved right")
    assert all(c.roll == 1.0 for c in commands.wait_for_count(50)), "the stick is held"

    do("pull_out")
    process.wait_for_line("'Virtual Flight Stick' was pulled out; no joystick is there", WAIT_S)
    world.wait_for_diagnostics("joystick", lambda status: status.level == 1 and "silent" in status.message)
    assert commands.last.roll == 1.0, "not let go by the unplugging"
    world.wait_for_diagnostics("joy_reader: device", lambda status: status.level == 1)
    do("plug")
    joy.wait_for_next(lambda j: list(j.axes) == [0.0] * 6)
    do("axis 0 -32768")
    commands.wait_for(lambda c: c.fields & ROLL and c.roll == -1.0)
    do("button 1 1")
    joy.wait_for(lambda j: j.buttons[1] == 1)
