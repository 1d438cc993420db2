"""X-Plane's own autopilot: its modes, switched by commands, shown by datarefs. `emulator/servos.py` flies by it."""

from __future__ import annotations

from typing import Callable, Dict, Mapping, Optional, Protocol

from xplane_bridge.emulator.datarefs.sources import FlownAircraft
from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.flight.frame import MPS_TO_FPM, MPS_TO_KT, Frame

AP = "sim/cockpit2/autopilot/"
YAW_DAMPER = "sim/cockpit2/switches/yaw_damper_on"
MASTER, AUTOTHROTTLE = AP + "flight_director_mode", AP + "autothrottle_enabled"
ROLL, HEADING = AP + "roll_status", AP + "heading_status"
PITCH, CLIMB, SPEED = AP + "pitch_status", AP + "vvi_status", AP + "speed_status"
ALTITUDE, ALTITUDE_ARMED, HELD_FT = AP + "altitude_hold_status", AP + "altitude_hold_armed", AP + "altitude_hold_ft"
NAV, APPROACH = AP + "nav_status", AP + "approach_status"
GLIDESLOPE, GLIDESLOPE_ARMED = AP + "glideslope_status", AP + "glideslope_armed"
HEADING_DIAL, ALTITUDE_DIAL = AP + "heading_dial_deg_mag_pilot", AP + "altitude_dial_ft"
CLIMB_DIAL, SPEED_DIAL, IS_MACH = AP + "vvi_dial_fpm", AP + "airspeed_dial_kts_mach", AP + "airspeed_is_mach"
HELD_PITCH = AP + "sync_hold_pitch_deg"
OFF, DIRECTOR, SERVOS = 0.0, 1.0, 2.0  #: of MASTER
ARMED, CAPTURED = 1.0, 2.0
#: The modes of an axis: what `heading_mode` and `altitude_mode` show while one is captured.
LATERAL = {ROLL: 0, HEADING: 1, NAV: 2, APPROACH: 2}
VERTICAL = {PITCH: 3, CLIMB: 4, ALTITUDE: 6, SPEED: 5, GLIDESLOPE: 8}
#: An armed altitude is captured so many seconds before it is reached, and at least so near [ft].
_CAPTURE_S, _CAPTURE_FT = 6.0, 60.0
#: An armed line is captured where its needle is off the stop, an armed path where it is near.
_LINE_DOTS, _PATH_DOTS = 2.4, 0.5


class NeedlesShown(Protocol):
    """What the receiver that the autopilot follows shows."""

    @property
    def dots(self) -> float:
        """Of the line's needle."""

    @property
    def path_dots(self) -> Optional[float]:
        """Of the path's needle; None: no path is heard."""


class Autopilot:
    """Switches modes, one lateral and one vertical at a time; lines and paths of radios are captured from armed modes.

    Aircraft without an autopilot (`ModelInfo.autopilot`) take no command.

    Args:
        store: Has its datarefs.
        sim: The loaded aircraft and its flight.
    """

    def __init__(self, store: DatarefStore, sim: FlownAircraft) -> None:
        self._store = store
        self._sim = sim

    def commands(self) -> Dict[str, Callable[[], None]]:
        """What each of its commands does."""
        table: Dict[str, Callable[[], None]] = {
            "fdir_on": lambda: self._set(MASTER, max(self._get(MASTER), DIRECTOR)),
            "fdir_toggle": lambda: self._set(MASTER, OFF if self._get(MASTER) else DIRECTOR),
            "servos_on": lambda: self._set(MASTER, SERVOS),
            "servos_toggle": lambda: self._set(MASTER, DIRECTOR if self._get(MASTER) == SERVOS else SERVOS),
            "servos_off_any": lambda: self._set(MASTER, min(self._get(MASTER), DIRECTOR)),
            "servos_fdir_off": self.switch_off,
            "wing_leveler": lambda: self._engage(LATERAL, ROLL),
            "heading": lambda: self._toggle(LATERAL, HEADING, ROLL),
            "vertical_speed": lambda: self._toggle(VERTICAL, CLIMB, PITCH),
            "level_change": lambda: self._toggle(VERTICAL, SPEED, PITCH),
            "altitude_hold": lambda: self._toggle(VERTICAL, ALTITUDE, PITCH),
            "altitude_arm": lambda: self._set(ALTITUDE_ARMED, float(not self._get(ALTITUDE_ARMED))),
            "NAV": lambda: self._arm_or_end(NAV),
            "approach": self._toggle_approach,
            "autothrottle_on": lambda: self._set(AUTOTHROTTLE, 1.0),
            "autothrottle_off": lambda: self._set(AUTOTHROTTLE, 0.0),
            "autothrottle_toggle": lambda: self._set(AUTOTHROTTLE, float(not self._get(AUTOTHROTTLE))),
        }
        named = {"sim/autopilot/" + name: action for name, action in table.items()}
        named["sim/systems/yaw_damper_on"] = lambda: self._set(YAW_DAMPER, 1.0)
        named["sim/systems/yaw_damper_off"] = lambda: self._set(YAW_DAMPER, 0.0)
        return {name: self._if_there(action) for name, action in named.items()}

    def switch_off(self) -> None:
        """No flight director, no servos, no modes; dials, autothrottle and yaw damper stay."""
        for name in (MASTER, *LATERAL, *VERTICAL, ALTITUDE_ARMED, GLIDESLOPE_ARMED):
            self._set(name, OFF)

    def follows_radio(self) -> bool:
        """Whether a mode that goes by radio is armed or captured."""
        return self._sim.model.info.autopilot and any(self._get(name) for name in (NAV, APPROACH))

    def update(self, failed: bool, needles: Optional[NeedlesShown]) -> None:
        """A frame in flight: the modes it begins with, and what is captured.

        Args:
            failed: Whether it has failed.
            needles: Of the receiver that it follows; None where that hears no station.
        """
        if not self._sim.model.info.autopilot:
            return
        if failed:
            self.switch_off()
            self._set(AUTOTHROTTLE, OFF)
            return
        self._follow(needles)
        if self._get(MASTER):
            for group, basic in ((LATERAL, ROLL), (VERTICAL, PITCH)):
                if not any(self._get(name) == CAPTURED for name in group):
                    self._engage(group, basic)
        if self._get(ALTITUDE_ARMED) and not self._get(ALTITUDE) and not self._get(GLIDESLOPE):
            left = abs(self._get(ALTITUDE_DIAL) - self._sim.instruments.altitude_ft)
            if left < max(_CAPTURE_FT, abs(self._climb_fpm()) / 60.0 * _CAPTURE_S):
                self._engage(VERTICAL, ALTITUDE)
                self._set(HELD_FT, self._get(ALTITUDE_DIAL))
                self._set(ALTITUDE_ARMED, OFF)

    def _follow(self, needles: Optional[NeedlesShown]) -> None:
        """Captures armed lines and paths, and lets go of those that are not heard any more."""
        for name in (NAV, APPROACH):
            if needles is None and self._get(name) == CAPTURED:
                self._set(name, OFF)
            elif needles is not None and self._get(name) == ARMED and abs(needles.dots) < _LINE_DOTS:
                self._engage(LATERAL, name)
        path = None if needles is None else needles.path_dots
        if path is None or self._get(APPROACH) != CAPTURED:
            self._set(GLIDESLOPE, OFF)
        elif self._get(GLIDESLOPE_ARMED) and abs(path) < _PATH_DOTS:
            self._engage(VERTICAL, GLIDESLOPE)
            self._set(GLIDESLOPE_ARMED, OFF)

    def _climb_fpm(self) -> float:
        return -self._sim.frame.m.v_down_mps * MPS_TO_FPM

    def _get(self, name: str) -> float:
        return self._store.get(name)

    def _set(self, name: str, value: float) -> None:
        self._store.set(name, value)

    def _if_there(self, action: Callable[[], None]) -> Callable[[], None]:
        return lambda: action() if self._sim.model.info.autopilot else None

    def _toggle(self, group: Mapping[str, int], name: str, basic: str) -> None:
        self._engage(group, basic if self._get(name) else name)

    def _arm_or_end(self, name: str) -> None:
        self._set(name, OFF if self._get(name) else ARMED)

    def _toggle_approach(self) -> None:
        self._arm_or_end(APPROACH)
        self._set(GLIDESLOPE_ARMED, self._get(APPROACH))

    def _engage(self, group: Mapping[str, int], name: str) -> None:
        """A mode of a group; like X-Plane's, most turn their dial to what is flown. What is armed stays so."""
        for other in group:
            if other == name or self._get(other) != ARMED:
                self._set(other, CAPTURED if other == name else OFF)
        if name == CLIMB:
            self._set(CLIMB_DIAL, 100.0 * round(self._climb_fpm() / 100.0))
        elif name == SPEED and not self._get(IS_MACH):
            self._set(SPEED_DIAL, round(self._sim.frame.m.calibrated_airspeed_mps * MPS_TO_KT))
        elif name == ALTITUDE:
            self._set(HELD_FT, self._sim.instruments.altitude_ft)
        elif name == PITCH:
            self._set(HELD_PITCH, self._sim.frame.true_theta)


def captured_mode(store: DatarefStore, group: Mapping[str, int]) -> int:
    """The number of an axis's captured mode (`LATERAL`, `VERTICAL`); 0 where none is."""
    return next((number for name, number in group.items() if store.get(name) == CAPTURED), 0)


def dial_speed_kt(store: DatarefStore, frame: Frame) -> float:
    """The dial as an indicated airspeed at the present height [kt]."""
    dial = store.get(SPEED_DIAL)
    if not store.get(IS_MACH):
        return dial
    return dial / max(frame.m.mach, 0.05) * frame.m.calibrated_airspeed_mps * MPS_TO_KT
