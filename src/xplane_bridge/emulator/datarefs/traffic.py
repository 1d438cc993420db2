"""Other aircraft: those that the emulator flies, those that clients place, and how both are shown.

An aircraft that the emulator flies goes straight on, level, at the speed it has. A client that sets its element of
`override_planepath` moves it by writing its position, attitude and velocity in the axes of the scenery's origin;
VEHX does both at once. What a client has placed stays, and flies on from there when it is given back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Dict, FrozenSet, Tuple

import numpy as np

from xplane_bridge.emulator.datarefs.placement import PATH_OVERRIDE, is_place
from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.emulator.flight.frame import Frame
from xplane_bridge.protocol import VehiclePose
from xplane_bridge.units import moved

#: Others than the user's aircraft, which is number 0.
MOST = 19
PLANE = "sim/multiplayer/position/" + "plane{}_"
WRITTEN = ("x", "y", "z", "the", "phi", "psi", "v_x", "v_y", "v_z")
GEODETIC = ("lat", "lon", "el")
#: Of the aircraft that the emulator flies: the first is ahead and to the right, each next one further.
_AHEAD_M, _APART_M, _SPEED_MPS = 1500.0, 300.0, 60.0
#: Of the first one where the emulator flies none: beside the runway, on the apron.
_PARKED_RIGHT_M = 215.0


@dataclass
class OtherAircraft:
    """One of them. Angles in degrees against the local level, velocity north, east, down [m/s]."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    heading_deg: float = 0.0
    velocity: Tuple[float, float, float] = (0.0, 0.0, 0.0)


class Traffic:
    """All other aircraft by their number.

    Args:
        store: The simulator's datarefs, with those of `define`.
        otherwise: Of `otherwise.IDS`: in what X-Plane is not as the bridge assumes.
    """

    def __init__(self, store: DatarefStore, otherwise: FrozenSet[str] = frozenset()) -> None:
        self.aircraft: Dict[int, OtherAircraft] = {}
        self._store = store
        self._placeable, self._written = "other-aircraft" not in otherwise, "other-written" not in otherwise
        self._pending: Dict[int, Dict[str, float]] = {}
        self._shown: Dict[int, Tuple[object, ...]] = {}  # of each: what its datarefs show; gone where one was written
        for number in range(1, MOST + 1):
            for leaf in WRITTEN:
                store.on_write(PLANE.format(number) + leaf, partial(self._remember, number, leaf))
            for leaf in (*WRITTEN, *GEODETIC):
                store.on_write(PLANE.format(number) + leaf, partial(self._forget, number))

    def start(self, count: int, initial: InitialState, home: InitialState) -> None:
        """`count` aircraft that the emulator flies, ahead of `initial`; with none, one is parked beside the runway.

        Args:
            count: How many.
            initial: Where flights start.
            home: A flight over the middle of the runway, along it.
        """
        if count == 0:
            turn = math.radians(home.heading_deg)
            offset = (-_PARKED_RIGHT_M * math.sin(turn), _PARKED_RIGHT_M * math.cos(turn))
            place = moved(home.latitude_deg, home.longitude_deg, *offset)
            self.aircraft[1] = OtherAircraft(*place, home.terrain_elevation_m, heading_deg=home.heading_deg)
        turn = math.radians(initial.heading_deg)
        for number in range(1, count + 1):
            ahead, right = _AHEAD_M + _APART_M * number, 0.5 * _APART_M * number
            north = ahead * math.cos(turn) - right * math.sin(turn)
            east = ahead * math.sin(turn) + right * math.cos(turn)
            latitude, longitude = moved(initial.latitude_deg, initial.longitude_deg, north, east)
            height = max(initial.altitude_m, initial.terrain_elevation_m + 300.0) + 30.0 * number
            velocity = (_SPEED_MPS * math.cos(turn), _SPEED_MPS * math.sin(turn), 0.0)
            self.aircraft[number] = OtherAircraft(
                latitude, longitude, height, heading_deg=initial.heading_deg, velocity=velocity
            )

    def place(self, request: VehiclePose) -> bool:
        """VEHX: holds an aircraft at a pose; whether it does."""
        numbers = (request.latitude_deg, request.longitude_deg, request.elevation_m)
        angles = (request.roll_deg, request.pitch_deg, request.heading_deg)
        if not self._placeable or not 1 <= request.aircraft <= MOST or not is_place((*numbers, *angles)):
            return False
        latitude, longitude, elevation = numbers
        self.aircraft[request.aircraft] = OtherAircraft(latitude, earth.wrap_half_turn(longitude), elevation, *angles)
        self._store.values[self._store.dataref(PATH_OVERRIDE).slots[request.aircraft]] = 1.0
        return True

    def poses(self) -> Tuple[Tuple[float, float, float, float, float, float], ...]:
        """Latitude, longitude [deg], altitude [m], roll, pitch, heading [deg] of each, for who draws them."""
        return tuple(
            (a.latitude_deg, a.longitude_deg, a.altitude_m, a.roll_deg, a.pitch_deg, a.heading_deg)
            for a in self.aircraft.values()
        )

    def held(self, number: int) -> bool:
        """Whether a client moves it."""
        return self._store.get(PATH_OVERRIDE, number) != 0.0

    def step(self, dt: float, frame: Frame) -> None:
        """Takes what clients have written, and flies what they do not hold."""
        pending, self._pending = self._pending, {}
        for number, written in pending.items():
            if self.held(number) and self._written:
                self._move(number, written, frame)
        for number, other in self.aircraft.items():
            if not self.held(number):
                north, east, down = other.velocity
                place = moved(other.latitude_deg, other.longitude_deg, north * dt, east * dt)
                other.latitude_deg, other.longitude_deg = place
                other.altitude_m -= down * dt
        self._show(frame)

    def _remember(self, number: int, leaf: str, _index: int, value: float) -> None:
        self._pending.setdefault(number, {})[leaf] = value

    def _forget(self, number: int, _index: int, _value: float) -> None:
        self._shown.pop(number, None)

    def _move(self, number: int, written: Dict[str, float], frame: Frame) -> None:
        now = self._in_scenery(self.aircraft[number], frame) if number in self.aircraft else dict.fromkeys(WRITTEN, 0.0)
        new = {**now, **written}
        place = frame.local.to_geodetic(new["x"], new["y"], new["z"])
        if not is_place((*place, *new.values())):
            return
        to_level = frame.local.from_level(*place[:2]).T
        angles = earth.euler_degrees(to_level @ earth.body_to_level(new["phi"], new["the"], new["psi"]))
        north, east, down = (float(v) for v in to_level @ np.array((-new["v_z"], new["v_x"], -new["v_y"])))
        self.aircraft[number] = OtherAircraft(*place, *angles, velocity=(north, east, down))

    @staticmethod
    def _in_scenery(other: OtherAircraft, frame: Frame) -> Dict[str, float]:
        """What X-Plane shows of it in the axes of the scenery's origin, by leaf."""
        from_level = frame.local.from_level(other.latitude_deg, other.longitude_deg)
        body = earth.body_to_level(other.roll_deg, other.pitch_deg, other.heading_deg)
        roll, pitch, heading = earth.euler_degrees(from_level @ body)
        x, y, z = frame.local.to_local(other.latitude_deg, other.longitude_deg, other.altitude_m)
        north, east, down = (float(v) for v in from_level @ np.array(other.velocity))
        return dict(zip(WRITTEN, (x, y, z, pitch, roll, heading, east, -down, -north)))

    def _show(self, frame: Frame) -> None:
        store = self._store
        for number, other in self.aircraft.items():
            shown = (*vars(other).values(), frame.local.lat_ref, frame.local.lon_ref)
            if self._shown.get(number) == shown:
                continue  # most often it is parked
            self._shown[number] = shown
            plane = PLANE.format(number)
            for leaf, value in self._in_scenery(other, frame).items():
                store.values[store.locate(plane + leaf)] = value
            for leaf, value in zip(GEODETIC, (other.latitude_deg, other.longitude_deg, other.altitude_m)):
                store.values[store.locate(plane + leaf)] = value

    def relative(self, frame: Frame) -> Dict[int, Tuple[float, float, float]]:
        """What TCAS reports of each: distance [m], bearing from the nose [deg], height above the user's [m]."""
        out = {}
        for number, other in self.aircraft.items():
            place = (frame.m.latitude_deg, frame.m.longitude_deg)
            x, y, z = frame.local.to_local(other.latitude_deg, other.longitude_deg, other.altitude_m)
            distance = math.dist((x, y, z), frame.position)
            bearing = earth.bearing_degrees(*place, other.latitude_deg, other.longitude_deg)
            out[number] = (
                distance,
                earth.wrap_half_turn(bearing - frame.true_psi),
                other.altitude_m - frame.m.altitude_m,
            )
        return out
