"""Reads a joystick with SDL (pygame) and numbers its axes and buttons as ROS's joy_node does.

joy_node reads the kernel's joystick interface: axes in the kernel's order with each hat as two more axes behind them;
left, up and forward are +; an axis reads 0 until it is first moved. SDL's evdev driver has the same order, but keeps
hats apart, and right, down and backward are +, except that a hat's up is +. (The rare axes whose event codes lie behind
those of the hats come before the hats here.)
"""

from __future__ import annotations

import importlib
import os
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, Iterable, List, Optional, Set, Tuple

from xplane_bridge.errors import XplaneBridgeError

#: Settings that SDL reads when it starts, as environment variables.
SDL_ENVIRONMENT = {
    "SDL_VIDEODRIVER": "dummy",  # events come without a window, and without a display
    "SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS": "1",
    # SDL's own drivers for some gamepads number axes and buttons differently from the kernel.
    "SDL_JOYSTICK_HIDAPI": "0",
    "SDL_LINUX_JOYSTICK_DEADZONES": "1",  # the small ones a driver reports: the kernel's interface has them
    "SDL_NO_SIGNAL_HANDLERS": "1",  # Ctrl-C is ROS's
    "PYGAME_HIDE_SUPPORT_PROMPT": "1",
}
#: For at least so long after a joystick was lost nothing is published, though it be back at once, so that subscribers
#: see it go: its levers read 0 until they are touched, which is not where they stood before [s].
REST_S = 1.0


class JoystickError(XplaneBridgeError):
    """Joysticks cannot be read, or a wish for one cannot be understood."""


def start_sdl() -> Any:
    """The module pygame, with its joystick and event parts started.

    Raises:
        JoystickError: pygame is not there, or SDL does not start.
    """
    os.environ.update(SDL_ENVIRONMENT)
    try:
        pygame = importlib.import_module("pygame")
    except ImportError as error:
        raise JoystickError(
            f"pygame, which reads joysticks, is not there ({error}): run scripts/setup, or: pip install pygame"
        ) from None
    try:
        pygame.display.init()  # the event queue lives in it
        pygame.joystick.init()
    except pygame.error as error:
        raise JoystickError(f"SDL cannot read joysticks: {error}") from None
    return pygame


def device_names(pygame: Any) -> List[str]:
    """The names of all joysticks that are plugged in, in SDL's order."""
    return [pygame.joystick.Joystick(index).get_name() for index in range(pygame.joystick.get_count())]


def choose(names: List[str], wanted: str) -> Tuple[Optional[int], str]:
    """Which joystick is meant.

    Args:
        names: of all that are plugged in, in SDL's order.
        wanted: index; or a part of the name, in capitals or not; empty: the first.

    Returns:
        Its index, or None, and why there is none.
    """
    there = "plugged in: " + (", ".join(f"{i} {name!r}" for i, name in enumerate(names)) or "none")
    if not names:
        return None, "no joystick is there; looking for one (may this user read /dev/input? Group input, or a seat)"
    if not wanted:
        return 0, ""
    if wanted.isdigit():
        index = int(wanted)
        return (index, "") if index < len(names) else (None, f"there is no joystick {index}; {there}; looking for it")
    fitting = [i for i, name in enumerate(names) if wanted.lower() in name.lower()]
    if len(fitting) == 1:
        return fitting[0], ""
    if fitting:
        return None, f"{len(fitting)} joysticks are called {wanted!r}: choose one by its index; {there}"
    return None, f"there is no joystick called {wanted!r}; {there}; looking for it"


def shape(value: float, deadzone: float) -> float:
    """joy_node's axis value [-1..1] for SDL's.

    Args:
        value: as pygame's events have it, right and down +: SDL's -32768..32767 by 32767.
        deadzone: [0..1) of the travel that reads 0; the rest is stretched.
    """
    travel = max(-1.0, min(value, 1.0))
    beyond = max(0.0, abs(travel) - deadzone) / (1.0 - deadzone)
    return -beyond if travel > 0.0 else beyond


@dataclass
class JoyState:
    """What a sensor_msgs/Joy says."""

    axes: List[float] = field(default_factory=list)  #: [-1..1] left, up, forward +
    buttons: List[int] = field(default_factory=list)

    def copy(self) -> JoyState:
        """One that does not change any more."""
        return JoyState(list(self.axes), list(self.buttons))


class JoyReader:
    """One joystick: events in, states to publish out.

    Args:
        pygame: the module, as `start_sdl` gives it.
        wanted: which joystick, see `choose`.
        deadzone: [0..1) of each axis' travel from its centre.
        autorepeat_rate: [1/s] of states while nothing changes; 0: none.
        coalesce_interval: [s] in which changes of axes are put into one state; buttons go out at once.
        rest_s: Gives how long to rest after a joystick was lost [s]: longer than any subscriber takes to see it go.

    Raises:
        JoystickError: A number is out of its range.
    """

    def __init__(
        self,
        pygame: Any,
        wanted: str = "",
        deadzone: float = 0.0,
        autorepeat_rate: float = 50.0,
        coalesce_interval: float = 0.005,
        rest_s: Callable[[], float] = lambda: REST_S,
    ) -> None:
        for name, value, low, high in (
            ("deadzone", deadzone, 0.0, 0.95),
            ("autorepeat rate", autorepeat_rate, 0.0, 1000.0),
            ("coalesce interval", coalesce_interval, 0.0, 1.0),
        ):
            if not low <= value <= high:
                raise JoystickError(f"{name} {value:g}: expected {low:g} to {high:g}")
        self._pygame = pygame
        self._wanted = wanted.strip()
        self._deadzone = deadzone
        self._repeat = 1.0 / autorepeat_rate if autorepeat_rate > 0.0 else float("inf")
        self._coalesce = coalesce_interval
        self._rest_s = rest_s
        self._device: Any = None
        self._read = ""  # name of the joystick read before
        self._present = set(self._instance_ids())  # of all that were plugged in before the events now handled
        self._others: Set[int] = set()  # of those that were plugged in beside ours when ours was lost
        self._state = JoyState()
        self._hats_from = 0
        self._changed_at: Optional[float] = None  # of the oldest axis change that has not been published
        self._published_at = 0.0
        self._rests_until = 0.0
        #: What a user should know about the device now; changes whenever there is something new to say.
        self.notice = ""
        self._look()

    @property
    def name(self) -> str:
        """Of the joystick that is read; empty while there is none."""
        return "" if self._device is None else str(self._device.get_name())

    def handle(self, events: Iterable[Any], now: float) -> List[JoyState]:
        """Takes SDL's events and gives what is to be published, in order.

        Args:
            events: all that SDL has at this moment.
            now: [s] of a steady clock.
        """
        out: List[JoyState] = []
        kinds = self._pygame
        replugged = False
        for event in events:
            replugged |= event.type in (kinds.JOYDEVICEADDED, kinds.JOYDEVICEREMOVED)
            if event.type == kinds.JOYDEVICEADDED:
                if self._device is None:
                    self._look()
            elif event.type == kinds.JOYDEVICEREMOVED:
                self._present.discard(event.instance_id)
                self._others.discard(event.instance_id)
                if self._is_ours(event):
                    # Just before, SDL has let every axis and button go; the user did not.
                    out.clear()
                    self._lose(now)
                elif self._device is None:
                    self._look()
            elif self._is_ours(event) and self._apply(event, now):
                out.append(self._take(now))
        if replugged:
            self._present = set(self._instance_ids())
        if now < self._rests_until:
            return []
        if self._device is not None and not out and self._is_due(now):
            out.append(self._take(now))
        return out

    def patience(self, now: float) -> float:
        """How long nothing has to be published if no event comes [s]."""
        if self._device is None or now < self._rests_until:
            return 0.1
        until = self._published_at + self._repeat
        if self._changed_at is not None:
            until = min(until, self._changed_at + self._coalesce)
        return max(0.0, min(until - now, 0.5))

    def _is_due(self, now: float) -> bool:
        if self._changed_at is not None and now >= self._changed_at + self._coalesce:
            return True
        return now >= self._published_at + self._repeat

    def _take(self, now: float) -> JoyState:
        self._published_at = now
        self._changed_at = None
        return self._state.copy()

    def _is_ours(self, event: Any) -> bool:
        return self._device is not None and getattr(event, "instance_id", None) == self._device.get_instance_id()

    def _apply(self, event: Any, now: float) -> bool:
        """Takes one event of our device; True if it has to go out at once."""
        kinds = self._pygame
        if event.type == kinds.JOYAXISMOTION:
            self._move({event.axis: shape(event.value, self._deadzone)}, now)
        elif event.type == kinds.JOYHATMOTION:
            right, up = event.value
            first = self._hats_from + 2 * event.hat
            self._move({first: float(-right), first + 1: float(up)}, now)
        elif event.type in (kinds.JOYBUTTONDOWN, kinds.JOYBUTTONUP) and event.button < len(self._state.buttons):
            self._state.buttons[event.button] = int(event.type == kinds.JOYBUTTONDOWN)
            return True
        return False

    def _move(self, axes: Dict[int, float], now: float) -> None:
        for index, value in axes.items():
            if index < len(self._state.axes) and self._state.axes[index] != value:
                self._state.axes[index] = value
                if self._changed_at is None:
                    self._changed_at = now

    def _instance_ids(self) -> List[int]:
        """SDL's names of all joysticks that are plugged in, none of which it gives twice; in its order."""
        joystick = self._pygame.joystick
        return [joystick.Joystick(index).get_instance_id() for index in range(joystick.get_count())]

    def _look(self) -> None:
        index, problem = self._choose(device_names(self._pygame))
        if index is None:
            self.notice = problem
            return
        self._device = device = self._pygame.joystick.Joystick(index)
        self._read = self.name
        self._hats_from = device.get_numaxes()
        self._state = JoyState([0.0] * (device.get_numaxes() + 2 * device.get_numhats()), [0] * device.get_numbuttons())
        self._changed_at = float("-inf")  # its presence is published at once
        self.notice = (
            f"reading {device.get_name()!r}: {device.get_numaxes()} axes, {device.get_numhats()} hats as "
            f"{2 * device.get_numhats()} more, {device.get_numbuttons()} buttons"
        )

    def _choose(self, names: List[str]) -> Tuple[Optional[int], str]:
        """As `choose`, but who has flown with one joystick is not handed another one when it is pulled out."""
        index, problem = choose(names, self._wanted)
        if not self._read:
            return index, problem
        # Nor one of the same name that was there all the time, perhaps another person's.
        ids = self._instance_ids()
        same = [i for i, name in enumerate(names) if name == self._read and ids[i] not in self._others]
        if index in same or len(same) == 1:
            return (index if index in same else same[0]), ""
        return None, problem or "looking for it; to read another one, start again"

    def _lose(self, now: float) -> None:
        name = self.name
        self._others = self._present
        self._rests_until = now + self._rest_s()
        self._device.quit()
        self._device = None
        self._look()
        if self._device is None:
            self.notice = f"{name!r} was pulled out; {self.notice}"
