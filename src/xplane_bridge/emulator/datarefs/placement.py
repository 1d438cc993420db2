"""Putting the aircraft somewhere: PREL, VEHX, VEHS, and writes to position, attitude, velocity and rates."""

from __future__ import annotations

import math
from functools import partial
from typing import Dict, Optional, Sequence

import numpy as np

from xplane_bridge import protocol
from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.flight_model import HIGHEST_LATITUDE_DEG, FlightModel, InitialState
from xplane_bridge.emulator.flight.frame import Frame

#: Of aircraft by their number; 0 is the user's.
PATH_OVERRIDE = "sim/operation/override/override_planepath"
_POSITION = "sim/flightmodel/position/"
_WRITABLE = [
    "local_x",
    "local_y",
    "local_z",
    "local_vx",
    "local_vy",
    "local_vz",
    "theta",
    "phi",
    "psi",
    "P",
    "Q",
    "R",
    "Prad",
    "Qrad",
    "Rrad",
]


class Placements:
    """Collects what clients write to the aircraft's motion in one frame and moves the aircraft at once.

    A client that sets a position sends several DREFs; applied one by one they would pass through places in between.
    The flight model turns the aircraft by `q` and writes the angles; only while it is overridden do the angles count,
    and then `q` does not.
    """

    #: Moves beyond these are not made: X-Plane has no such places, and no flight model flies there.
    MAX_SPEED_MPS = 600.0
    MAX_RATE_RAD_S = 20.0
    ELEVATION_M = (-1000.0, 30000.0)

    #: PREL start types: repeat the last one; latitude, longitude, elevation.
    REPEAT_LAST = 5
    START_AT_PLACE = 6
    #: A start at less than this height above the ground, with less than this speed, is one on the ground.
    GROUND_HEIGHT_M = 5.0
    GROUND_SPEED_MPS = 5.0

    def __init__(self, store: DatarefStore) -> None:
        self._store = store
        self._pending: Dict[str, float] = {}
        for leaf in _WRITABLE:
            store.on_write(_POSITION + leaf, partial(self._remember, leaf))
        store.on_write(_POSITION + "q", lambda i, value: self._remember(f"q{i}", i, value))

    def _remember(self, leaf: str, _index: int, value: float) -> None:
        self._pending[leaf] = value

    def clear(self) -> None:
        """Forgets what was written."""
        self._pending.clear()

    def apply(self, model: FlightModel, frame: Frame) -> None:
        """Moves the aircraft as written since the last frame."""
        if not self._pending:
            return
        pending, self._pending = self._pending, {}
        changes: Dict[str, object] = {}
        if any(leaf in pending for leaf in ("local_x", "local_y", "local_z")):
            xyz = [pending.get(f"local_{axis}", now) for axis, now in zip("xyz", frame.position)]
            place = frame.local.to_geodetic(*xyz)
            changes["latitude_deg"], changes["longitude_deg"], changes["altitude_m"] = place
        latitude = changes.get("latitude_deg", frame.m.latitude_deg)
        longitude = changes.get("longitude_deg", frame.m.longitude_deg)
        to_level = frame.local.from_level(latitude, longitude).T  # type: ignore[arg-type]
        attitude = _attitude(pending, frame, self._store.get(PATH_OVERRIDE) != 0.0)
        if attitude is not None:
            roll, pitch, heading = earth.euler_degrees(to_level @ attitude)
            changes["roll_rad"], changes["pitch_rad"] = math.radians(roll), math.radians(pitch)
            changes["heading_rad"] = math.radians(heading)
        if any(leaf.startswith("local_v") for leaf in pending):
            x, y, z = (pending.get(f"local_v{axis}", now) for axis, now in zip("xyz", frame.velocity))
            changes["v_ned_mps"] = [float(v) for v in to_level @ np.array((-z, x, -y))]
        rates = [frame.m.p_rad_s, frame.m.q_rad_s, frame.m.r_rad_s]
        for i, axis in enumerate("PQR"):
            if axis in pending:
                rates[i] = math.radians(pending[axis])
            rates[i] = pending.get(axis + "rad", rates[i])
        if any(leaf[0] in "PQR" for leaf in pending):
            changes["pqr_rad_s"] = rates
        if changes and self._is_flyable(changes):
            model.place(**changes)  # type: ignore[arg-type]

    @classmethod
    def _is_flyable(cls, changes: Dict[str, object]) -> bool:
        latitude: float = changes.get("latitude_deg", 0.0)  # type: ignore[assignment]
        elevation: float = changes.get("altitude_m", 0.0)  # type: ignore[assignment]
        velocity: Sequence[float] = changes.get("v_ned_mps", (0.0,))  # type: ignore[assignment]
        rates: Sequence[float] = changes.get("pqr_rad_s", (0.0,))  # type: ignore[assignment]
        return (
            abs(latitude) <= HIGHEST_LATITUDE_DEG
            and cls.ELEVATION_M[0] <= elevation <= cls.ELEVATION_M[1]
            and max(map(abs, velocity)) <= cls.MAX_SPEED_MPS
            and max(map(abs, rates)) <= cls.MAX_RATE_RAD_S
        )

    @staticmethod
    def initial_state(request: protocol.Placement, terrain_m: float) -> Optional[InitialState]:
        """The start of a flight at PREL's place; None if its numbers are none of a place."""
        numbers = (
            request.latitude_deg,
            request.longitude_deg,
            request.elevation_m,
            request.heading_deg,
            request.speed_mps,
        )
        if not (is_place(numbers) and 0.0 <= request.speed_mps <= Placements.MAX_SPEED_MPS):
            return None
        height = request.elevation_m - terrain_m
        on_ground = height < Placements.GROUND_HEIGHT_M and request.speed_mps < Placements.GROUND_SPEED_MPS
        return InitialState(
            latitude_deg=request.latitude_deg,
            longitude_deg=earth.wrap_half_turn(request.longitude_deg),
            heading_deg=earth.wrap_degrees(request.heading_deg),
            on_ground=on_ground,
            altitude_m=max(request.elevation_m, terrain_m),
            airspeed_mps=None if on_ground else request.speed_mps,
            terrain_elevation_m=terrain_m,
        )

    @staticmethod
    def set_speed(model: FlightModel, initial: InitialState) -> None:
        """Gives an aircraft that was started elsewise the airspeed of `initial`, level and straight ahead."""
        speed = initial.airspeed_mps or 0.0
        heading, air = math.radians(initial.heading_deg), model.state
        north, east = speed * math.cos(heading) + air.wind_north_mps, speed * math.sin(heading) + air.wind_east_mps
        model.place(v_ned_mps=[north, east, 0.0], pqr_rad_s=(0.0, 0.0, 0.0))

    @staticmethod
    def place_vehicle(model: FlightModel, request: protocol.VehiclePose) -> bool:
        """Puts the aircraft at VEHX's or VEHS's pose; it keeps its velocity along its own axes and stops turning.

        Returns:
            False if the numbers are none of a pose.
        """
        numbers = (
            request.latitude_deg,
            request.longitude_deg,
            request.elevation_m,
            request.heading_deg,
            request.pitch_deg,
            request.roll_deg,
        )
        if not is_place(numbers):
            return False
        state = model.state
        rotation = earth.body_to_level(request.roll_deg, request.pitch_deg, request.heading_deg)
        velocity = rotation @ np.array((state.u_mps, state.v_mps, state.w_mps))
        model.place(
            latitude_deg=request.latitude_deg,
            longitude_deg=earth.wrap_half_turn(request.longitude_deg),
            altitude_m=request.elevation_m,
            roll_rad=math.radians(request.roll_deg),
            pitch_rad=math.radians(request.pitch_deg),
            heading_rad=math.radians(earth.wrap_degrees(request.heading_deg)),
            v_ned_mps=[float(v) for v in velocity],
            pqr_rad_s=(0.0, 0.0, 0.0),
        )
        return True


def is_place(numbers: Sequence[float]) -> bool:
    """Whether latitude, longitude, elevation, and finite further numbers, are those of a place to put an aircraft."""
    if not all(map(math.isfinite, numbers)):
        return False
    latitude, longitude, elevation = numbers[:3]
    low, high = Placements.ELEVATION_M
    return abs(latitude) <= HIGHEST_LATITUDE_DEG and abs(longitude) <= 360.0 and low <= elevation <= high


def _attitude(pending: Dict[str, float], frame: Frame, overridden: bool) -> Optional[np.ndarray]:
    """Body to origin axes as written, by the angles where the flight model is overridden, else by q; None: neither."""
    if overridden:
        if any(leaf in pending for leaf in ("theta", "phi", "psi")):
            return earth.body_to_level(
                pending.get("phi", frame.phi), pending.get("theta", frame.theta), pending.get("psi", frame.psi)
            )
    elif any(f"q{i}" in pending for i in range(4)):
        try:
            return earth.rotation_from_quaternion(*(pending.get(f"q{i}", frame.q[i]) for i in range(4)))
        except ValueError:
            return None
    return None
