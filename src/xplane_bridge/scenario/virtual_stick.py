"""A joystick that is not there: turns what a scenario's stick does into axes and buttons of a device's YAML.

The joystick mapper turns them back, so that a scripted flight passes through the same equations as a hand on the stick.
"""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any, Dict, List, Optional, Tuple

import numpy as np
import yaml

from xplane_bridge.errors import text_problem, yaml_problem
from xplane_bridge.scenario.player import Commands
from xplane_bridge.scenario.schema import Scenario, ScenarioError

#: A device whose file names higher axes or buttons has more of them.
AXIS_COUNT, BUTTON_COUNT = 8, 12
_GRID = np.linspace(0.0, 1.0, 2001)
#: An axis that has been moved, and back to its middle; too small to be seen in a command.
_TOUCHED = float(np.finfo(np.float32).tiny)
#: Of numbers that come from ramps and scales.
_ROUNDING = 1e-9
#: Handles that a device moves while something is pressed, not to a value: a script cannot say them through a stick.
_SPRUNG = 0.0


class VirtualStick:
    """One device.

    Args:
        device: The content of a file of config/joysticks.
        stick_mode: 1 or 2; None: the device's own.

    Raises:
        ScenarioError: The device lacks what every stick needs.
    """

    def __init__(self, device: Dict[str, Any], stick_mode: Optional[int] = None) -> None:
        self.name = str(device.get("device", "joystick"))
        mode = stick_mode or int(device.get("stick_mode", 2))
        direct = {str(entry.get("target", key)): (key, entry) for key, entry in device.get("direct", {}).items()}
        self._axes: Dict[str, Tuple[int, Dict[str, Any]]] = {}
        for axis in ("roll", "pitch", "yaw", "throttle"):
            if axis in direct:
                key, entry = direct[axis]
                index = _axis_index(entry, mode)
                if index < 0:
                    raise ScenarioError(f"{self.name}: direct.{key} names no axis")
                self._axes[axis] = (index, entry)
        for axis in ("roll", "pitch", "yaw"):
            if axis not in self._axes:
                raise ScenarioError(f"{self.name}: direct.{axis} is missing; a virtual stick needs it")
        self._axis_count = _axis_count(device, mode)
        self._button_count = _button_count(device)
        #: By target and whether the handle is far from 0 while they are pressed.
        self._buttons = {
            (str(entry.get("target", key)), float(entry.get("value", 1.0)) >= 0.5): int(entry["button"])
            for key, entry in device.get("buttons", {}).items()
            if int(entry["button"]) >= 0
        }
        self._mode_buttons = {key: int(value) for key, value in device.get("mode", {}).items() if int(value) >= 0}
        self._throttle_axis_known = "throttle" in self._axes

    def provide_buttons(self, scenario: Scenario) -> None:
        """Has the buttons that a scenario presses, whether or not its file names them."""
        for event in scenario.events:
            for kind, value in event.actions:
                if kind == "buttons":
                    numbers = [number for given in value.values() for number in given]
                    self._button_count = max([self._button_count, *(number + 1 for number in numbers)])

    def mode_button(self, mode: str, present: str) -> Optional[int]:
        """The button that asks for a mode; None when nothing has to be pressed.

        Raises:
            ScenarioError: The device has no button for it.
        """
        if mode in self._mode_buttons:
            return self._mode_buttons[mode]
        if "toggle" not in self._mode_buttons:
            raise ScenarioError(f"{self.name}: there is no button for mode {mode}")
        return None if mode == present else self._mode_buttons["toggle"]

    def joy(self, commands: Commands) -> Tuple[List[float], List[int]]:
        """Axes [-1..1] and buttons of a sensor_msgs/Joy.

        Raises:
            ScenarioError: The scenario moves something that this device cannot move, or not so far.
        """
        axes, buttons = [0.0] * self._axis_count, [0] * self._button_count
        moved = dict(commands.stick)
        if commands.throttle is not None:
            if not self._throttle_axis_known:
                raise ScenarioError(f"{self.name}: its throttle has no lever, which a scenario needs")
            moved["throttle"] = commands.throttle
        for axis, value in moved.items():
            index, entry = self._axes[axis]
            axes[index] = self._position(axis, value, entry)
        pressed = set(commands.buttons)
        for handle, value in commands.handles.items():
            button = self._handle_button(handle, value)
            if button is not None:
                pressed.add(button)
        for button in pressed:
            buttons[button] = 1
        return axes, buttons

    def _position(self, axis: str, value: float, entry: Dict[str, Any]) -> float:
        """Where the device's axis is when it commands `value`."""
        low, high = _reach(entry)
        if not low - _ROUNDING <= value <= high + _ROUNDING:
            raise ScenarioError(
                f"{self.name}: {axis} at {value:g}: its axis gives {low:g} to {high:g}; fly this scenario with "
                "commands instead of a stick"
            )
        position = _inverse(value, entry)
        return _TOUCHED if position == 0.0 and entry.get("silent_until_moved") else position

    def _handle_button(self, handle: str, value: float) -> Optional[int]:
        if handle == "gear" or (handle == "brakes" and (handle, True) in self._buttons):
            if value not in (0.0, 1.0):
                raise ScenarioError(
                    f"{self.name}: {handle} at {value:g}: a button moves it to 0 or 1 only; fly this scenario with "
                    "commands instead of a stick"
                )
            if handle == "brakes" and value == 0.0:
                return None  # a pressed button brakes, none lets go
            if (handle, value == 1.0) not in self._buttons:
                raise ScenarioError(f"{self.name}: there is no button for gear {'down' if value else 'up'}")
            return self._buttons[handle, value == 1.0]
        if value == _SPRUNG:
            return None
        raise ScenarioError(
            f"{self.name}: {handle} is moved by a hat as long as that is pressed, not to a value; "
            "fly this scenario with commands instead of a stick"
        )


def refuse_buttons(scenario: Scenario, way: str) -> None:
    """Of a scenario that is flown by commands, which have no buttons.

    Args:
        scenario: What is to be flown.
        way: The option by which a joystick flies it.

    Raises:
        ScenarioError: It presses some.
    """
    for i, event in enumerate(scenario.events):
        if any(kind == "buttons" for kind, _ in event.actions):
            raise ScenarioError(
                f"{scenario.name}: events[{i}].buttons: commands have no buttons; fly it through a joystick ({way}), "
                "or write mode or handles instead"
            )


def load_stick(file: Path, stick_mode: Optional[int] = None) -> VirtualStick:
    """The device of a file of config/joysticks.

    Raises:
        ScenarioError: There is no such file, or it is not a device.
    """
    try:
        device = yaml.safe_load(file.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{file}: {text_problem(error)}; expected a file of config/joysticks") from None
    except yaml.YAMLError as error:
        raise ScenarioError(f"{file}: {yaml_problem(error)}") from None
    if not isinstance(device, dict):
        raise ScenarioError(f"{file}: expected a mapping with device, direct, ...")
    # A section whose lines are all comments is none.
    return VirtualStick({key: value for key, value in device.items() if value is not None}, stick_mode)


def _axis_index(entry: Dict[str, Any], mode: int) -> int:
    """Below 0: none."""
    index = entry.get("axis", entry.get(f"axis_mode_{mode}"))
    return -1 if index is None else int(index)


def _axis_count(device: Dict[str, Any], mode: int) -> int:
    entries = [entry for section in ("direct", "integrated", "surfaces") for entry in device.get(section, {}).values()]
    return max(AXIS_COUNT, *(_axis_index(entry, mode) + 1 for entry in entries))


def _button_count(device: Dict[str, Any]) -> int:
    sections = ("integrated", "buttons", "surfaces", "functions")
    entries = [entry for section in sections for entry in device.get(section, {}).values()]
    named = [number for entry in entries for key, number in entry.items() if key.endswith("button")]
    return max(BUTTON_COUNT, *(int(number) + 1 for number in (*named, *device.get("mode", {}).values(), -1)))


def _reach(entry: Dict[str, Any]) -> Tuple[float, float]:
    """The ends of what equation (1) makes of the axis."""
    reach = min(abs(float(entry.get("scale", 1.0))), 1.0)
    if entry.get("travel") == "full":
        return 0.5 * (1.0 - reach), 0.5 * (1.0 + reach)
    return (0.0 if entry.get("travel") == "positive" else -reach), reach


@functools.lru_cache(maxsize=None)
def _curve(expo: float) -> np.ndarray:
    curve: np.ndarray = (1.0 - expo) * _GRID + expo * _GRID**3
    return curve


def _inverse(value: float, entry: Dict[str, Any]) -> float:
    """The axis that equation (1) turns into `value`."""
    dead_zone, expo = float(entry.get("dead_zone", 0.0)), float(entry.get("expo", 0.0))
    # `full`: the whole travel becomes 0..1
    delta = 2.0 * value - 1.0 if entry.get("travel") == "full" else value
    shaped = delta / float(entry.get("scale", 1.0))
    beyond = float(np.interp(min(abs(shaped), 1.0), _curve(expo), _GRID))
    magnitude = 0.0 if beyond == 0.0 else dead_zone + beyond * (1.0 - dead_zone)
    return float(np.copysign(magnitude, shaped))
