"""joy_config_check: shows live what each axis and button of a joystick does under a file of config/joysticks.

What is shown as command comes from joystick_mapper_node itself: one is started with the file, in a namespace of its
own, where no node receives its commands.
"""

from __future__ import annotations

import argparse
import collections
import itertools
import os
import re
import shutil
import sys
import tempfile
import time
from pathlib import Path
from textwrap import wrap
from typing import Any, Deque, Dict, List, Optional, Sequence, Tuple

from xplane_bridge.cli.entry import guarded, ros_arguments, start_node
from xplane_bridge.harness.processes import ManagedProcess
from xplane_bridge.harness.ros import ros_environment
from xplane_bridge.joystick.config_table import JoyConfigError, Live, load_joy_config, screen, skeleton
from xplane_bridge.resources import config_file, node_program
from xplane_bridge.topics import NAMESPACE, absolute

_REFRESH_S = 0.1
_RATE_OVER_S = 2.0
_REQUESTS_SHOWN = 5
_HOME, _CLEAR_LINE, _CLEAR_BELOW, _CURSOR_OFF, _CURSOR_ON = "\x1b[H", "\x1b[K", "\x1b[J", "\x1b[?25l", "\x1b[?25h"
#: Commands to bits and fields of ControlCommand, where they are not the same word.
_TOE_BRAKES = {"brakes": "left_brake", "left_brake": "left_brake", "right_brake": "right_brake"}


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="joy_config_check",
        description=(
            "Shows live what each axis and button on NS/joy does under a joystick's file: raw value, command and "
            "function, what is not mapped, and what is wrong in the file. The file may be edited meanwhile: it is read "
            "again when it is saved. Nothing reaches the aircraft. Another program has to publish the joystick, for "
            "example joystick.launch driver:=sdl."
        ),
    )
    p.add_argument("joy_config", nargs="?", metavar="JOY_CONFIG", help="file, or stem of a file in config/joysticks")
    p.add_argument("--stick-mode", type=int, choices=(1, 2), help="instead of the file's")
    p.add_argument("--once", action="store_true", help="show it once, without a terminal's tricks, and end")
    p.add_argument("--timeout", type=float, default=10.0, metavar="S", help="of waiting for the joystick (%(default)g)")
    p.add_argument(
        "--skeleton", type=Path, metavar="FILE", help="write a file to start from for the device that is there"
    )
    p.add_argument("--namespace", type=absolute, default=NAMESPACE, metavar="NS", help="of the bridge (%(default)s)")
    return p


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs the program."""
    args = parser().parse_args(ros_arguments(argv))
    if (args.joy_config is None) == (args.skeleton is None):
        raise JoyConfigError("expected a joystick's file to check, or --skeleton FILE; see --help")
    file = Path(args.joy_config or "")
    if args.skeleton is None:  # what can be said without ROS is said first
        if file.suffix not in (".yaml", ".yml"):
            file = config_file("joysticks", f"{args.joy_config}.yaml")
        load_joy_config(file, args.stick_mode)
    elif args.skeleton.exists():
        raise JoyConfigError(f"{args.skeleton} exists; give another name, or remove it")
    rospy = start_node("joy_config_check", anonymous=True, disable_signals=True)
    device = _Device(rospy, args.namespace)
    if args.skeleton is not None:
        return _write_skeleton(device, args.skeleton, args.timeout)
    with tempfile.TemporaryDirectory() as folder:
        check = _Check(rospy, device, file, args.stick_mode, Path(folder))
        try:
            return check.once(args.timeout) if args.once else check.live()
        finally:
            check.close()


class _Device:
    """What is heard of the joystick.

    Args:
        rospy: the module; its node runs.
        namespace: of the bridge.
    """

    def __init__(self, rospy: Any, namespace: str) -> None:
        from sensor_msgs.msg import Joy

        self.namespace = namespace.rstrip("/")
        self.last: Any = None
        self._times: Deque[float] = collections.deque(maxlen=400)
        rospy.Subscriber(f"{self.namespace}/joy", Joy, self._on_joy, tcp_nodelay=True)

    def _on_joy(self, message: Any) -> None:
        self.last = message
        self._times.append(time.monotonic())

    @property
    def rate(self) -> float:
        """Messages a second, of late."""
        since = time.monotonic() - _RATE_OVER_S
        return sum(moment > since for moment in list(self._times)) / _RATE_OVER_S

    def wait(self, timeout: float) -> Any:
        """The first message.

        Raises:
            JoyConfigError: None comes.
        """
        deadline = time.monotonic() + timeout
        while self.last is None:
            if time.monotonic() > deadline:
                raise JoyConfigError(
                    f"nothing on {self.namespace}/joy within {timeout:g} s; start its driver, for example: "
                    "roslaunch xplane_bridge joystick.launch driver:=sdl"
                )
            time.sleep(0.02)
        return self.last


def _write_skeleton(device: _Device, file: Path, timeout: float) -> int:
    joy = device.wait(timeout)
    text = skeleton(joy.header.frame_id, len(joy.axes), len(joy.buttons))
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise JoyConfigError(f"{file} cannot be written: {error.strerror}") from None
    print(f"wrote {file}; now: joy_config_check {file}")
    return 0


class _Check:
    """One file under check: the mapper that runs with it, and what it answers."""

    def __init__(self, rospy: Any, device: _Device, file: Path, stick_mode: Optional[int], folder: Path) -> None:
        from diagnostic_msgs.msg import DiagnosticArray

        from xplane_bridge.msg import ControlCommand, ModeRequest

        self._rospy, self._device, self._file, self._stick_mode, self._folder = rospy, device, file, stick_mode, folder
        self._namespace = f"/joy_config_check_{os.getpid()}"
        self._mapper: Optional[ManagedProcess] = None
        self._config = load_joy_config(file, stick_mode)
        self._seen: Optional[Tuple[int, int, int]] = None
        self._error = ""
        self._command: Any = None
        self._status: Dict[str, str] = {}
        self._problems = ""
        self._requests: Deque[str] = collections.deque(maxlen=_REQUESTS_SHOWN)
        topic = self._namespace + "/control/"
        rospy.Subscriber(topic + "manual", ControlCommand, self._on_command, tcp_nodelay=True)
        rospy.Subscriber(topic + "mode_request", ModeRequest, self._on_request)
        rospy.Subscriber(self._namespace + "/diagnostics", DiagnosticArray, self._on_diagnostics)

    # --- the two ways of showing it -----------------------------------------------------------------------------------

    def once(self, timeout: float) -> int:
        """Prints the picture when device and mapper have spoken; exit code 1 if anything is wrong."""
        self._start_mapper()
        self._device.wait(timeout)
        deadline = time.monotonic() + timeout
        while not self._answered() and not self._fault() and time.monotonic() < deadline:
            time.sleep(0.02)
        live = self._picture()
        if not self._answered() and not live.problems:
            live.problems = f"joystick_mapper_node has not answered within {timeout:g} s"
        print("\n".join(screen(self._config, live)))
        return 1 if live.problems else 0

    def _answered(self) -> bool:
        """Whether the mapper has heard the stick, and said what it makes of it."""
        heard = self._status.get("Messages (-)", "0") != "0"
        return heard and bool(self._command is not None or self._problems)

    def live(self) -> int:
        """Shows it until Ctrl-C; in place on a terminal, else whenever it changes."""
        terminal = sys.stdout.isatty()
        shown: List[str] = []
        if terminal:
            print(_CURSOR_OFF, end="")
        try:
            while not self._rospy.is_shutdown():
                self._reload()
                lines = screen(self._config, self._picture())
                if terminal:
                    self._draw(lines)
                elif lines != shown:
                    print("\n".join(lines), end="\n\n", flush=True)
                shown = lines
                time.sleep(_REFRESH_S)
        finally:
            if terminal:
                print(_CURSOR_ON, flush=True)
        return 0

    @staticmethod
    def _draw(lines: Sequence[str]) -> None:
        columns, rows = shutil.get_terminal_size()
        # A table is cut off at the edge, what is wrong is not: a file's path may fill a line.
        parts = [wrap(line, columns) if line.startswith("ERROR: ") else [line[:columns]] for line in lines]
        visible = [line + _CLEAR_LINE for line in list(itertools.chain.from_iterable(parts))[: rows - 1]]
        print(_HOME + "\n".join(visible) + _CLEAR_BELOW, end="", flush=True)

    def _picture(self) -> Live:
        joy, command = self._device.last, self._command
        live = Live(problems=self._fault() or self._problems, requests=list(self._requests))
        live.chosen = [key for key in self._status.get("Selected (-)", "").split(", ") if key]
        if joy is not None:
            live.axes, live.buttons, live.name, live.rate = (
                joy.axes,
                joy.buttons,
                joy.header.frame_id,
                self._device.rate,
            )
        if command is not None and not self._error:
            live.commands = commanded(command)
        return live

    # --- the mapper ---------------------------------------------------------------------------------------------------

    def _version(self) -> Tuple[int, int, int]:
        """What is another after the file has been saved; the time alone has steps of milliseconds."""
        status = self._file.stat()
        return status.st_mtime_ns, status.st_size, status.st_ino

    def _reload(self) -> None:
        """Starts again with the file when it has been saved anew."""
        try:
            version = self._version()
        except OSError:
            return  # an editor is writing it
        if version == self._seen:
            return
        self._seen = version  # before it is read: what is saved meanwhile is another version
        try:
            self._config = load_joy_config(self._file, self._stick_mode)
        except JoyConfigError as error:
            self._error = str(error)
            return
        self._start_mapper()

    def _start_mapper(self) -> None:
        self.close()
        self._error = ""
        self._command, self._problems, self._status = None, "", {}
        name = f"{self._namespace}/joystick_mapper_node"
        content = dict(self._config.content)
        if self._stick_mode is not None:
            content["stick_mode"] = self._stick_mode
        self._rospy.set_param(name, content)
        env = ros_environment()
        command = [
            str(node_program("joystick_mapper_node", env)),
            f"__ns:={self._namespace}",
            f"joy:={self._device.namespace}/joy",
            f"/diagnostics:={self._namespace}/diagnostics",
        ]
        self._mapper = ManagedProcess("joystick_mapper_node", command, self._folder, env={**env, **_ros_of_here()})
        self._mapper.start()

    def _fault(self) -> str:
        """Why the mapper does not run; empty when it does."""
        if self._mapper is not None and not self._mapper.running and not self._error:
            self._error = complaint(self._mapper.output(), f"{self._namespace}/joystick_mapper_node/")
        return self._error

    def close(self) -> None:
        """Ends the mapper."""
        if self._mapper is not None:
            self._mapper.stop()
            self._mapper = None
            if self._rospy.has_param(self._namespace):
                self._rospy.delete_param(self._namespace)

    # --- what it answers ----------------------------------------------------------------------------------------------

    def _on_command(self, message: Any) -> None:
        self._command = message

    def _on_request(self, message: Any) -> None:
        self._requests.append("AUTO" if message.mode == message.AUTO else "MANUAL")

    def _on_diagnostics(self, array: Any) -> None:
        for status in array.status:
            if status.name.endswith("joystick"):
                self._status = {pair.key: pair.value for pair in status.values}
                self._problems = status.message if status.level == status.ERROR else ""


def commanded(command: Any) -> Dict[str, float]:
    """What a ControlCommand commands: target to value, targets named as in the joystick's file."""
    values = {}
    bits = {name.lower(): getattr(command, name) for name in dir(command) if name.isupper() and name != "ALL_FIELDS"}
    for name, bit in bits.items():
        if command.fields & bit and hasattr(command, name) and name not in ("motors", "engine_throttles"):
            values[name] = getattr(command, name)
    if command.fields & command.TOE_BRAKES:
        values.update({name: getattr(command, attribute) for name, attribute in _TOE_BRAKES.items()})
    return values


def complaint(output: str, prefix: str) -> str:
    """What a node that has ended said about it, with the keys as they stand in the file."""
    plain = re.sub(r"\x1b\[[0-9;]*m", "", output)
    said = re.findall(r"^\[(?:FATAL|ERROR)\][^:]*: (.*)$", plain, re.MULTILINE)
    text = said[-1] if said else (plain.strip().splitlines() or ["joystick_mapper_node ended without a word"])[-1]
    return text.replace(prefix, "").replace("/", ".")


def _ros_of_here() -> Dict[str, str]:
    """The variables by which this process finds its ROS master."""
    return {key: value for key, value in os.environ.items() if key in ("ROS_MASTER_URI", "ROS_IP", "ROS_HOSTNAME")}
