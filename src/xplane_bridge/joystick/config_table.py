"""What a file of config/joysticks says about each axis and button, in words; what is wrong in it, the mapper says."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple

import yaml

from xplane_bridge.errors import XplaneBridgeError, is_number, unsettable, yaml_problem

_BAR = 8  #: characters of an axis' bar on either side of its middle
_MODES = {"manual": "asks for MANUAL", "auto": "asks for AUTO", "toggle": "asks for the other mode"}
_COLUMNS = ((6, ">"), (8, ">"), (2 * _BAR + 1, "<"), (22, "<"), (0, "<"))


class JoyConfigError(XplaneBridgeError):
    """A joystick's file cannot be used; the text says where, and why."""


@dataclass(frozen=True)
class Function:
    """One thing that an axis or a button does."""

    key: str  #: in the YAML, e.g. direct.roll
    text: str
    target: str = ""  #: what it commands; empty: nothing by itself
    chosen_by: bool = False  #: several share the axis; the mapper says which is chosen


@dataclass
class JoyConfig:
    """A device's file."""

    file: Path
    content: Dict[str, Any]
    stick_mode: int
    axes: Dict[int, List[Function]] = field(default_factory=dict)
    buttons: Dict[int, List[Function]] = field(default_factory=dict)

    @property
    def device(self) -> str:
        """Its name for messages."""
        return str(self.content.get("device", self.file.stem))


def load_joy_config(file: Path, stick_mode: Optional[int] = None) -> JoyConfig:
    """Reads a device's file.

    Args:
        file: of config/joysticks, or like one.
        stick_mode: 1 or 2; None: as the file says.

    Raises:
        JoyConfigError: It is not there, not YAML, or has what ROS cannot set.
    """
    try:
        text = file.read_text(encoding="utf-8")
        content, node = yaml.safe_load(text), yaml.compose(text)
    except OSError as error:
        raise JoyConfigError(f"{file}: {error.strerror}; expected a file like those in config/joysticks") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise JoyConfigError(f"{file}: {yaml_problem(error)}") from None
    if not isinstance(content, dict):
        raise JoyConfigError(
            f"{file}: expected keys like device, direct, integrated, buttons, mode; see config/joysticks"
        )
    empty = {name for name, section in content.items() if section is None}  # all lines of it are comments
    problems = [f"{name.replace('/', '.')} {what}" for name, what in unsettable(node) if name not in empty]
    if problems:
        raise JoyConfigError(f"{file}: {'; '.join(problems)}")
    content = {name: section for name, section in content.items() if name not in empty}
    mode = stick_mode or (1 if content.get("stick_mode") == 1 else 2)
    config = JoyConfig(file, content, mode)
    for name, entry in _entries(content, "direct"):
        target = str(entry.get("target", name))
        _note(config.axes, _axis(entry, mode), Function(f"direct.{name}", f"{target}", target))
    for name, entry in _entries(content, "integrated"):
        _note_integrated(config, name, entry, mode)
    for name, entry in _entries(content, "buttons"):
        target = str(entry.get("target", name))
        text = f"{target} {_number(entry.get('value'))}"
        if "released" in entry:
            text += f", {_number(entry['released'])} when released"
        _note(config.buttons, entry.get("button"), Function(f"buttons.{name}", text, target))
    for name, entry in _entries(content, "surfaces"):
        _note_surface(config, name, entry, mode)
    for name, entry in _entries(content, "functions"):
        _note(config.buttons, entry.get("button"), Function(f"functions.{name}", _function_text(entry)))
    mode_section = content.get("mode")
    for name, button in (mode_section if isinstance(mode_section, dict) else {}).items():
        _note(config.buttons, button, Function(f"mode.{name}", _MODES.get(name, str(name))))
    return config


def _entries(content: Dict[str, Any], section: str) -> List[Tuple[str, Dict[str, Any]]]:
    entries = content.get(section)
    if not isinstance(entries, dict):
        return []
    return [(str(name), entry) for name, entry in entries.items() if isinstance(entry, dict)]


def _axis(entry: Dict[str, Any], mode: int) -> Any:
    return entry.get("axis", entry.get(f"axis_mode_{mode}"))


def _note(where: Dict[int, List[Function]], index: Any, function: Function) -> None:
    if isinstance(index, int) and index >= 0:
        where.setdefault(index, []).append(function)


def _note_integrated(config: JoyConfig, name: str, entry: Dict[str, Any], mode: int) -> None:
    target, key = str(entry.get("target", name)), f"integrated.{name}"
    chosen_by = isinstance(entry.get("select_button"), int) and entry["select_button"] >= 0
    _note(config.axes, _axis(entry, mode), Function(key, f"moves {target}", target, chosen_by))
    for end, word in (("increase_button", "up"), ("decrease_button", "down")):
        _note(config.buttons, entry.get(end), Function(key, f"moves {target} {word}", target, chosen_by))
    _note(config.buttons, entry.get("select_button"), Function(key, f"chooses {target}"))


def _note_surface(config: JoyConfig, name: str, entry: Dict[str, Any], mode: int) -> None:
    key = f"surfaces.{name}"
    verb = "moves" if entry.get("rate") else "sets"
    _note(config.axes, _axis(entry, mode), Function(key, f"{verb} {name}", "", True))
    for end, word in (("increase_button", "down"), ("decrease_button", "up")):
        _note(config.buttons, entry.get(end), Function(key, f"moves {name} {word}", "", True))
    _note(config.buttons, entry.get("select_button"), Function(key, f"chooses {name}, or gives it back"))


def _function_text(entry: Dict[str, Any]) -> str:
    does = entry.get("does")
    if does == "pause":
        return "pauses and resumes"
    if does == "view":
        return f"view {entry.get('view')}"
    if does == "failure":
        value = f" at {_number(entry['value'])}" if "value" in entry else ""
        return f"breaks and repairs {entry.get('name')}: {entry.get('kind')}{value}"
    return f"command {entry.get('command')}"


def _number(value: Any) -> str:
    return f"{value:g}" if is_number(value) else str(value)


# ----------------------------------------------------------------------------------------------------------- screen


@dataclass
class Live:
    """What the device and the mapper say now."""

    axes: Optional[Sequence[float]] = None  #: None: no message has come
    buttons: Sequence[int] = ()
    name: str = ""  #: of the device, where the driver gives it
    rate: float = 0.0  #: [1/s] of messages
    commands: Dict[str, float] = field(default_factory=dict)  #: target to value, those that are commanded
    chosen: Sequence[str] = ()  #: keys of the integrated inputs that are chosen
    problems: str = ""
    requests: Sequence[str] = ()  #: of modes, newest last


def screen(config: JoyConfig, live: Live) -> List[str]:
    """The lines of the whole picture."""
    lines = [f"{config.device}: {config.file}, stick mode {config.stick_mode}"]
    if live.axes is None:
        lines.append("no message of a joystick yet")
    else:
        who = f" of {live.name!r}" if live.name else ""
        lines.append(f"{live.rate:.0f} messages/s{who}: {len(live.axes)} axes, {len(live.buttons)} buttons")
    if live.problems:
        lines += [f"ERROR: {problem}" for problem in live.problems.split("; ")]
    lines += ["", _line("axis", "raw", "-1      0      +1", "command", "what it does"), ""]
    axes = live.axes or ()
    for index in sorted(set(range(len(axes))) | set(config.axes)):
        raw = axes[index] if index < len(axes) else None
        known = "no such axis" if live.axes is not None and raw is None else ""
        command, text = _cells(config.axes.get(index, []), live)
        lines.append(_line(index, "" if raw is None else f"{raw:+.3f}", known or _bar(raw), command, text))
    lines += ["", _line("button", "", "", "command", "what it does"), ""]
    for index in sorted(set(range(len(live.buttons))) | set(config.buttons)):
        there = index < len(live.buttons)
        known = "no such button" if live.axes is not None and not there else ""
        pressed = "pressed" if there and live.buttons[index] else ""
        command, text = _cells(config.buttons.get(index, []), live)
        lines.append(_line(index, pressed, known, command, text))
    lines += ["", "mode requests: " + (", ".join(live.requests) or "none"), "in brackets: not chosen now"]
    return lines


def _cells(functions: Sequence[Function], live: Live) -> Tuple[str, str]:
    texts, commands = [], []
    for function in functions:
        asleep = function.chosen_by and live.chosen and function.key not in live.chosen
        texts.append(f"({function.text})" if asleep else f"{function.text} [{function.key}]")
        if function.target in live.commands and not asleep:
            # A negative number that rounds to zero is shown as zero.
            commands.append(f"{function.target} {round(live.commands[function.target], 3) + 0.0:+.3f}")
    return ", ".join(commands), "; ".join(texts) or "- not mapped -"


def _line(*cells: Any) -> str:
    words = (f"{cell!s:{align}{width or ''}}" for cell, (width, align) in zip(cells, _COLUMNS))
    return "  ".join(words).rstrip()


def _bar(value: Optional[float]) -> str:
    cells = ["·"] * _BAR + ["|"] + ["·"] * _BAR
    if value is not None and value == value:
        end = round(max(-1.0, min(value, 1.0)) * _BAR)
        for k in range(min(end, 0), max(end, 0) + 1):
            cells[_BAR + k] = "█" if k else "|"
    return "".join(cells)


# --------------------------------------------------------------------------------------------------------- skeleton

_STICK = (
    ("roll", "scale: -1.0, dead_zone: 0.05, expo: 0.3", "right + (joy has left +)"),
    ("pitch", "scale: -1.0, dead_zone: 0.05, expo: 0.3", "stick back: nose up"),
    ("yaw", "scale: -1.0, dead_zone: 0.05, expo: 0.3", "right +"),
    ("throttle", "scale: 1.0, travel: full, silent_until_moved: true", "forward +; a lever that stays where it is put"),
)


def skeleton(device: str, axes: int, buttons: int) -> str:
    """A file to start from for a device of so many axes and buttons: the stick on the first axes, the rest named.

    Raises:
        JoyConfigError: It has too few axes for a stick.
    """
    if axes < 2:
        raise JoyConfigError(f"{device or 'the device'} has {axes} axes; a stick needs at least 2")
    lines = [
        "# Axes in the order of the device: look with joy_config_check what moves, and put the indices right.",
        "# Every key is explained in config/joysticks/README.md.",
        "",
        f"device: {yaml.safe_dump(device or 'my joystick', width=1000).splitlines()[0]}",
        "stick_mode: 2",
        "",
        "direct:",
    ]
    used = min(axes, len(_STICK))
    lines += [f"  {name}: {{axis: {k}, {keys}}}   # {note}" for k, (name, keys, note) in enumerate(_STICK[:used])]
    lines += [f"# free axes: {_range(used, axes)}", "", "mode:"]
    lines += ["  toggle: 0" if buttons else "  toggle: -1", f"# free buttons: {_range(1, buttons)}"]
    return "\n".join(lines) + "\n"


def _range(first: int, end: int) -> str:
    return "none" if first >= end else str(first) if end == first + 1 else f"{first} to {end - 1}"
