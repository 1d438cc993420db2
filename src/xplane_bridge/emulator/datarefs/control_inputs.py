"""What moves the controls: clients (overrides, DREF, DATA rows), the scripted pilot, or nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np

from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.datarefs.tables.engines import (
    NORMAL,
    REVERSE,
    RPM_TO_RAD_S,
    THROTTLE_RELEASED,
    reset_switches,
    set_first,
)
from xplane_bridge.emulator.flight.flight_model import Controls, FlightModel
from xplane_bridge.emulator.flight.frame import Frame
from xplane_bridge.protocol import UNUSED_SLOT

_OVERRIDE = "sim/operation/override/override_"
_COCKPIT = "sim/cockpit2/controls/"
_ACTUATORS = "sim/cockpit2/engine/actuators/"
_ENGINE = "sim/flightmodel/engine/"

#: Stick axes: X-Plane's name, `Controls` attribute, slot in rows 8 and 11.
_AXES = (("pitch", "pitch", 0), ("roll", "roll", 1), ("heading", "yaw", 2))
#: The joystick that the pilot holds: for each of its axes what X-Plane's settings assign it to (X-Plane's numbers),
#: whether they reverse it, and the attribute of `PilotCommands`.
_JOYSTICK = "sim/joystick/joystick_"
_JOYSTICK_AXES = ((2, False, "roll"), (1, False, "pitch"), (3, False, "yaw"), (4, True, "throttle"))
#: Slots of DATA rows that move handles: (row, slot) -> (dataref, lowest, highest value).
_HANDLES = {
    (13, 0): (_COCKPIT + "elevator_trim", -1.0, 1.0),
    (13, 1): (_COCKPIT + "aileron_trim", -1.0, 1.0),
    (13, 2): (_COCKPIT + "rudder_trim", -1.0, 1.0),
    (13, 3): (_COCKPIT + "flap_ratio", 0.0, 1.0),
    (13, 6): (_COCKPIT + "speedbrake_ratio", -0.5, 1.0),
    (14, 0): (_COCKPIT + "gear_handle_down", 0.0, 1.0),
    (14, 1): (_COCKPIT + "parking_brake_ratio", 0.0, 1.0),
    (14, 2): (_COCKPIT + "left_brake_ratio", 0.0, 1.0),
    (14, 3): (_COCKPIT + "right_brake_ratio", 0.0, 1.0),
}
_THROTTLE_ROW, _TRIM_ROW = 25, 13
#: Rudder that auto-coordination gives for sideslip (wind from the right positive: the nose goes right).
_COORDINATION_PER_DEG = 0.1
#: Elevator, aileron and rudder: by slot of the row that holds them.
_TRIMS = tuple(_HANDLES[_TRIM_ROW, slot][0] for slot in range(3))
_HANDLE_NAMES = (
    *_TRIMS,
    _COCKPIT + "flap_ratio",
    _COCKPIT + "speedbrake_ratio",
    _COCKPIT + "gear_handle_down",
    _COCKPIT + "parking_brake_ratio",
)
_LEFT_BRAKE, _RIGHT_BRAKE = _COCKPIT + "left_brake_ratio", _COCKPIT + "right_brake_ratio"
#: In the order in which `_read_handles` takes them.
_READ_HANDLES = (
    *_HANDLE_NAMES,
    _COCKPIT + "thrust_vector_ratio",
    "sim/cockpit2/switches/artificial_stability_on",
    _LEFT_BRAKE,
    _RIGHT_BRAKE,
    _OVERRIDE + "toe_brakes",
    _OVERRIDE + "artstab",
)
#: Positions of the key: off and both magnetos; every other one lets an engine run as well.
_KEY_OFF, _KEY_BOTH = 0.0, 3.0
_IGNITION_KEY, _FUEL_SELECTOR = _ACTUATORS + "ignition_key", "sim/cockpit2/fuel/fuel_tank_selector"
#: Levers, handles and switches that a saved situation brings back and a new flight sets.
_LEVERS = (
    _ACTUATORS + "throttle_ratio",
    _ENGINE + "ENGN_propmode",
    _ACTUATORS + "prop_ratio",
    _ACTUATORS + "mixture_ratio",
    _IGNITION_KEY,
    _FUEL_SELECTOR,
    *_HANDLE_NAMES,
    _COCKPIT + "left_brake_ratio",
    _COCKPIT + "right_brake_ratio",
    _COCKPIT + "thrust_vector_ratio",
    "sim/joystick/yoke_pitch_ratio",
    "sim/joystick/yoke_roll_ratio",
    "sim/joystick/yoke_heading_ratio",
    "sim/cockpit2/electrical/battery_on",
    "sim/cockpit2/electrical/generator_on",
    "sim/cockpit2/electrical/inverter_on",
    "sim/cockpit2/switches/avionics_power_on",
)


@dataclass(frozen=True)
class PilotCommands:
    """What a scripted pilot wants; None leaves a control where it is."""

    roll: float = 0.0  #: -1..1, right +
    pitch: float = 0.0  #: -1..1, nose up +
    yaw: float = 0.0  #: -1..1, nose right +
    throttle: Optional[float] = None  #: all levers, 0..1
    trim_roll: Optional[float] = None  #: trims are moved when they change
    trim_pitch: Optional[float] = None
    trim_yaw: Optional[float] = None
    flaps: Optional[float] = None
    gear_down: Optional[bool] = None
    speedbrake: Optional[float] = None
    thrust_vector: Optional[float] = None
    brakes: Optional[float] = None
    datarefs: Tuple[Tuple[str, float], ...] = ()  #: to write once


@dataclass(frozen=True)
class InputOptions:
    """What moves the stick where neither a client nor the pilot does."""

    joystick: bool = True  #: attached and centred; without one, what clients write stays, under no override too
    auto_coordination: bool = False  #: the rudder follows the sideslip, as X-Plane does for who has no pedals


Pilot = Callable[[float, Frame], PilotCommands]


class ControlInputs:
    """Turns what was written into `Controls`, once a frame.

    The order of power on the stick: a DATA row that holds it, `override_joystick` (what was written to the yoke
    datarefs stays, pedals and auto-coordination included), the pilot, auto-coordination, and last the centred stick.
    Levers stay where they were put last; a DATA row that holds one does so against the pilot, too.
    """

    def __init__(self, store: DatarefStore, pilot: Optional[Pilot], options: InputOptions) -> None:
        self._options = options
        self._store = store
        self._pilot = pilot
        self._held: Dict[Tuple[int, int], float] = {}
        self._surface_commands: Dict[int, float] = {}
        self._throttle_commands: Dict[int, float] = {}
        self._surface_slots: Dict[str, int] = {}
        self._same_surface: Dict[int, int] = {}
        self._joystick_slots = np.zeros(0, dtype=int)
        self._handles: Callable[[], List[float]] = list  # as connect() makes it
        self._pilot_trims: Dict[str, float] = {}  # as the pilot has set them last in this flight
        self._fuel_on = 0.0  # position of the fuel selector, where a flight begins

    # --- definition ---------------------------------------------------------------------------------------------------

    def watch_surface(self, name: str) -> None:
        """Remembers writes to a dataref that shows surfaces (they count while the surfaces are overridden)."""
        slots = self._store.dataref(name).slots
        self._store.on_write(name, lambda index, value: self._command_surface(int(slots[index]), value))

    def connect(self, sim: Sources) -> None:
        """Connects the datarefs that act on others."""
        store = self._store
        for name in ("throttle_ratio", "mixture_ratio", "prop_ratio"):
            store.on_write(
                f"{_ACTUATORS}{name}_all", partial(lambda lever, _, value: store.set(_ACTUATORS + lever, value), name)
            )
        if "reverse-lever" not in sim.otherwise:
            signed = _ACTUATORS + "throttle_jet_rev_ratio"
            store.on_write(signed, self._move_reversing_lever)

            def move_all(_: int, value: float) -> None:
                for engine in range(store.elements(signed)):
                    self._move_reversing_lever(engine, value)

            store.on_write(signed + "_all", move_all)

        def set_speed(index: int, value: float) -> None:
            highest = sim.model.info.maximum_rpm * RPM_TO_RAD_S
            slot = store.dataref(_ACTUATORS + "prop_ratio").slots[index]
            store.values[slot] = min(max(value / highest, 0.0), 1.0) if highest > 0.0 else 0.0

        store.on_write(_ENGINE + "ENGN_prop", set_speed)
        store.on_write(_ACTUATORS + "prop_rotation_speed_rad_sec", set_speed)
        store.on_write(_ENGINE + "ENGN_thro_use", self._throttle_commands.__setitem__)
        if self._options.joystick:
            store.set("sim/joystick/has_joystick", 1.0)
            for axis, (assignment, reverse, _attribute) in enumerate(_JOYSTICK_AXES):
                store.values[store.locate(_JOYSTICK + "axis_assignments", axis)] = assignment
                store.values[store.locate(_JOYSTICK + "axis_reverse", axis)] = reverse
        self._handles = store.gather(_READ_HANDLES)
        self._fuel_on = store.get(_FUEL_SELECTOR)
        self._joystick_slots = store.dataref(_JOYSTICK + "axis_values").slots[: len(_JOYSTICK_AXES)]

    # --- flights ------------------------------------------------------------------------------------------------------

    def start(self, controls: Controls, model: FlightModel) -> None:
        """A flight begins: levers as `controls` has them, switches of the engines on."""
        engines = model.info.engine_count
        levers = (
            ("throttle_ratio", controls.throttle),
            ("prop_ratio", controls.propeller),
            ("mixture_ratio", controls.mixture),
        )
        for name, values in levers:
            set_first(self._store, _ACTUATORS + name, values[:engines], engines)
        reset_switches(self._store, engines)
        self._store.set(_FUEL_SELECTOR, self._fuel_on)
        self._pilot_trims.clear()
        for name, value in (
            (_COCKPIT + "elevator_trim", controls.trim_pitch),
            (_COCKPIT + "aileron_trim", controls.trim_roll),
            (_COCKPIT + "rudder_trim", controls.trim_yaw),
            (_COCKPIT + "flap_ratio", controls.flap_request),
            (_COCKPIT + "speedbrake_ratio", controls.speedbrake),
            (_COCKPIT + "gear_handle_down", float(controls.gear_down)),
            (_COCKPIT + "parking_brake_ratio", controls.parking_brake),
            (_COCKPIT + "thrust_vector_ratio", controls.thrust_vector),
        ):
            self._store.set(name, value)

    def save(self) -> Dict[str, np.ndarray]:
        """Levers, handles and switches, for a situation."""
        return {name: self._store.array(name) for name in _LEVERS}

    def restore(self, levers: Dict[str, np.ndarray]) -> None:
        """Puts back what `save` gave."""
        for name, values in levers.items():
            self._store.set(name, values)

    def show_trims(self, controls: Controls) -> None:
        """Shows trims that failures have moved or held: they stay so when that is repaired."""
        for name, value in zip(_TRIMS, (controls.trim_pitch, controls.trim_roll, controls.trim_yaw)):
            self._store.set(name, value)

    def turn_key(self, engine: int, on: bool) -> None:
        """Turns an engine's ignition key to both magnetos, or off."""
        self._store.values[self._store.locate(_IGNITION_KEY, engine)] = _KEY_BOTH if on else _KEY_OFF

    # --- DATA rows ----------------------------------------------------------------------------------------------------

    def take_row(self, row: int, slots: Sequence[float]) -> None:
        """A row that a client sent: values hold until -999 comes; rows and slots that control nothing are ignored."""
        for slot, value in enumerate(slots):
            key = (row, slot)
            if not (row == _THROTTLE_ROW or key in _HANDLES or (row in (8, 11) and slot < 3)):
                continue
            if value == UNUSED_SLOT:
                self._held.pop(key, None)
            elif np.isfinite(value):
                self._held[key] = float(value)
                # At once, so that it has moved also when -999 comes before the next frame.
                self._move_lever(row, slot, float(value))

    def release_data(self) -> None:
        """Gives back all that DATA rows held, as loading an aircraft does."""
        self._held.clear()

    # --- one frame ----------------------------------------------------------------------------------------------------

    def read(self, controls: Controls, model: FlightModel, frame: Frame) -> None:
        """Sets `controls` for this frame."""
        store = self._store
        joystick = self._overrides("joystick") or self._overrides("flightcontrol")
        commands: Optional[PilotCommands] = None
        if self._pilot is not None:
            commands = self._pilot(frame.clocks.flight, frame)
            for path, value in commands.datarefs:
                store.write(path, value)
            self._move_joystick(commands)
            # Who takes an axis flies: the pilot lets go of levers and handles, too.
            if not joystick and not any(self._overrides("joystick_" + axis) for axis, _attribute, _slot in _AXES):
                self._move_handles(commands, model)
        self._apply_held()
        for axis, attribute, slot in _AXES:
            name = f"sim/joystick/yoke_{axis}_ratio"
            held = self._held.get((8, slot), self._held.get((11, slot)))
            if held is not None:
                store.set(name, held)
            elif not joystick and not self._overrides("joystick_" + axis):
                if commands is not None:
                    store.set(name, getattr(commands, attribute))
                else:
                    self._move_unowned(name, axis, frame)
            setattr(controls, attribute, _clip(store.get(name), -1.0, 1.0))
        self._read_handles(controls)
        self._read_engines(controls, model)
        self._read_surfaces(controls)

    def _move_joystick(self, commands: PilotCommands) -> None:
        """The joystick's raw axes [0..1], which no override stops."""
        if not self._options.joystick:
            return
        for slot, (_assignment, reverse, attribute) in zip(self._joystick_slots, _JOYSTICK_AXES):
            value = getattr(commands, attribute)
            if value is not None:
                raw = _clip(value if attribute == "throttle" else 0.5 * (1.0 + value), 0.0, 1.0)
                self._store.values[slot] = 1.0 - raw if reverse else raw

    def _move_unowned(self, name: str, axis: str, frame: Frame) -> None:
        """An axis that no client has taken and no pilot moves."""
        if axis == "heading" and self._options.auto_coordination:
            self._store.set(name, _clip(_COORDINATION_PER_DEG * math.degrees(frame.m.beta_rad), -1.0, 1.0))
        elif self._options.joystick:
            self._store.set(name, 0.0)

    def _overrides(self, name: str) -> bool:
        return self._store.get(_OVERRIDE + name) != 0.0

    def _apply_held(self) -> None:
        for (row, slot), value in self._held.items():
            self._move_lever(row, slot, value)

    def _move_lever(self, row: int, slot: int, value: float) -> None:
        """Moves the lever or handle of a row's slot; a stick's slot is none."""
        if row == _THROTTLE_ROW:
            throttle = self._store.dataref(_ACTUATORS + "throttle_ratio").slots
            self._store.values[throttle[slot]] = _clip(value, 0.0, 1.0)
        elif (row, slot) in _HANDLES:
            name, low, high = _HANDLES[(row, slot)]
            self._store.set(name, _clip(value, low, high))

    def _move_reversing_lever(self, engine: int, value: float) -> None:
        """A lever that is below 0 in reverse: X-Plane keeps how far it is, and the propeller's mode."""
        store = self._store
        store.values[store.locate(_ACTUATORS + "throttle_ratio", engine)] = _clip(abs(value), 0.0, 1.0)
        store.values[store.locate(_ENGINE + "ENGN_propmode", engine)] = REVERSE if value < 0.0 else NORMAL

    def _move_handles(self, commands: PilotCommands, model: FlightModel) -> None:
        store = self._store
        if commands.throttle is not None and not self._overrides("throttles"):
            slots = store.dataref(_ACTUATORS + "throttle_ratio").slots[: model.info.engine_count]
            store.values[slots] = commands.throttle
        for name, value in (
            ("flap_ratio", commands.flaps),
            ("gear_handle_down", commands.gear_down),
            ("speedbrake_ratio", commands.speedbrake),
            ("thrust_vector_ratio", commands.thrust_vector),
            ("parking_brake_ratio", commands.brakes),
        ):
            if value is not None:
                store.set(_COCKPIT + name, float(value))
        # On change only: what a failure or a client has moved since then stays.
        for slot, (name, trim) in enumerate(zip(_TRIMS, (commands.trim_pitch, commands.trim_roll, commands.trim_yaw))):
            if trim is not None and self._pilot_trims.get(name) != trim and (_TRIM_ROW, slot) not in self._held:
                self._pilot_trims[name] = trim
                store.set(name, trim)

    def _read_handles(self, controls: Controls) -> None:
        (
            trim_pitch, trim_roll, trim_yaw, flaps, speedbrake, gear, parking_brake, vector, stability, left, right,
            toe_brakes_overridden, stability_overridden,
        ) = self._handles()  # fmt: skip
        controls.trim_pitch = _clip(trim_pitch, -1.0, 1.0)
        controls.trim_roll = _clip(trim_roll, -1.0, 1.0)
        controls.trim_yaw = _clip(trim_yaw, -1.0, 1.0)
        controls.flap_request = _clip(flaps, 0.0, 1.0)
        controls.speedbrake = _clip(speedbrake, -0.5, 1.0)
        controls.gear_down = gear != 0.0
        controls.parking_brake = _clip(parking_brake, 0.0, 1.0)
        if not toe_brakes_overridden:  # pedals that are not pressed
            if (14, 2) not in self._held:
                left = self._released(_LEFT_BRAKE, left)
            if (14, 3) not in self._held:
                right = self._released(_RIGHT_BRAKE, right)
        controls.brake_left, controls.brake_right = _clip(left, 0.0, 1.0), _clip(right, 0.0, 1.0)
        controls.thrust_vector = max(vector, 0.0)
        controls.artificial_stability = stability != 0.0 and not stability_overridden

    def _released(self, name: str, value: float) -> float:
        if value != 0.0:
            self._store.set(name, 0.0)
        return 0.0

    def _read_engines(self, controls: Controls, model: FlightModel) -> None:
        store, info = self._store, model.info
        levers = store.array(_ACTUATORS + "throttle_ratio")
        overridden = store.get(_ENGINE + "ENGN_thro_override")  # one number for all engines
        propeller, mixture = store.array(_ACTUATORS + "prop_ratio"), store.array(_ACTUATORS + "mixture_ratio")
        use, mode = store.array(_ENGINE + "ENGN_thro_use"), store.array(_ENGINE + "ENGN_propmode")
        key, has_fuel = store.array(_IGNITION_KEY), store.get(_FUEL_SELECTOR) != 0.0
        controls.override_throttles = self._overrides("throttles")
        for i in range(info.engine_count):
            lever = -levers[i] if mode[i] == REVERSE else levers[i]
            if overridden != THROTTLE_RELEASED:
                lever = overridden
            controls.throttle[i] = _clip(float(lever), info.min_throttle, info.max_throttle)
            controls.propeller[i] = _clip(float(propeller[i]), 0.0, 1.0)
            # without a spark or fuel it stops, and fires again while it is turned, as with its mixture cut off
            controls.mixture[i] = _clip(float(mixture[i]), 0.0, 1.0) if has_fuel and key[i] != 0.0 else 0.0
            controls.throttle_use[i] = _clip(self._throttle_commands.get(i, float(use[i])), -1.0, 1.0)
        if not controls.override_throttles:
            self._throttle_commands.clear()

    def _read_surfaces(self, controls: Controls) -> None:
        controls.override_surfaces = self._overrides("control_surfaces")
        if not controls.override_surfaces:
            self._surface_commands.clear()
            controls.surface_deg = {}
            return
        commands = self._surface_commands
        controls.surface_deg = {name: commands[slot] for name, slot in self._surface_slots.items() if slot in commands}

    def _command_surface(self, slot: int, value: float) -> None:
        self._surface_commands[self._same_surface.get(slot, slot)] = value

    def bind_surfaces(self, slots: Dict[str, int], same: Dict[int, int]) -> None:
        """Which slot shows which surface of the loaded aircraft, and which further slots show the same as one."""
        self._surface_slots, self._same_surface = slots, same


def _clip(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)
