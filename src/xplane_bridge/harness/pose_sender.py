"""Moves an X-Plane whose flight model is overridden (override_planepath) along recorded poses."""

from __future__ import annotations

import socket
import threading
from dataclasses import dataclass
from typing import Dict, Mapping

import numpy as np

from xplane_bridge import protocol

#: 1 switches the flight model of the user's aircraft off.
PATH_OVERRIDE = "sim/operation/override/override_planepath[0]"
#: Where the scenery's origin lies, and on which sphere: what poses are sent against.
SCENERY = ("sim/flightmodel/position/lat_ref", "sim/flightmodel/position/lon_ref", "sim/physics/earth_radius_m")
_POSITION = "sim/flightmodel/position/"


@dataclass
class Scenery:
    """Origin of X-Plane's local coordinates."""

    latitude_deg: float
    longitude_deg: float
    earth_radius: float  #: [m]

    def datarefs(self, pose: Mapping[str, float]) -> Dict[str, float]:
        """What is to be written for a pose: local position, attitude, local velocity.

        X-Plane shows the angles while its flight model is overridden, and flies on from the quaternion.

        Args:
            pose: Fields of a FlightState: place, `orientation.*` (frd into ned), `velocity_ned.*`.
        """
        here = _level(pose["latitude"], pose["longitude"])
        origin = _level(self.latitude_deg, self.longitude_deg)
        up_here, up_origin = -here[:, 2], -origin[:, 2]
        offset = (self.earth_radius + pose["altitude_msl"]) * up_here - self.earth_radius * up_origin
        north, east, down = origin.T @ offset
        turn = origin.T @ here  # ned here into ned of the origin
        velocity = turn @ np.array([pose[f"velocity_ned.{axis}"] for axis in "xyz"])
        attitude = turn @ _matrix(*(pose[f"orientation.{axis}"] for axis in "xyzw"))
        out = {"local_x": east, "local_y": -down, "local_z": -north}
        out.update(_angles(attitude))
        out.update({f"q[{k}]": value for k, value in enumerate(_quaternion(attitude))})
        out.update({"local_vx": velocity[1], "local_vy": -velocity[2], "local_vz": -velocity[0]})
        return {_POSITION + name: float(value) for name, value in out.items()}


class PoseSender:
    """Writes poses into an X-Plane.

    Args:
        host: Its address.
        port: The UDP port it listens on.
        scenery: Origin of its local coordinates.
    """

    def __init__(self, host: str, port: int, scenery: Scenery) -> None:
        self._to = (host, port)
        self._scenery = scenery
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._closed = False
        self._lock = threading.Lock()

    def send(self, pose: Mapping[str, float]) -> None:
        """Writes one pose, from any thread; none once it is closed."""
        messages = [protocol.DrefWrite(path, value).encode() for path, value in self._scenery.datarefs(pose).items()]
        with self._lock:
            if self._closed:
                return
            for message in messages:
                self._socket.sendto(message, self._to)

    def close(self) -> None:
        """Closes its socket: from now on nothing moves the aircraft."""
        with self._lock:
            self._closed = True
            self._socket.close()


def _level(latitude_deg: float, longitude_deg: float) -> np.ndarray:
    """Axes north, east, down at a place, as columns, against axes fixed to the Earth."""
    lat, lon = np.radians(latitude_deg), np.radians(longitude_deg)
    up = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    east = np.array([-np.sin(lon), np.cos(lon), 0.0])
    return np.stack([np.cross(up, east), east, -up], axis=1)


def _matrix(x: float, y: float, z: float, w: float) -> np.ndarray:
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _angles(matrix: np.ndarray) -> Dict[str, float]:
    """Pitch, roll and heading of a rotation by X-Plane's names [deg]."""
    roll, heading = np.arctan2(matrix[2, 1], matrix[2, 2]), np.arctan2(matrix[1, 0], matrix[0, 0])
    pitch = np.arcsin(np.clip(-matrix[2, 0], -1.0, 1.0))
    return {"theta": np.degrees(pitch), "phi": np.degrees(roll), "psi": np.degrees(heading) % 360.0}


def _quaternion(matrix: np.ndarray) -> np.ndarray:
    """w, x, y, z of a rotation: the eigenvector of its largest eigenvalue, w not negative."""
    m = matrix
    k = np.array(
        [
            [m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]],
            [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1]],
        ]
    )
    vector = np.linalg.eigh(k)[1][:, -1]
    return vector if vector[0] >= 0.0 else -vector
