"""rx_node's flight state written in rospy, as a peer to measure against: receive, decode, convert, publish.

usage: rospy_rx.py HOST PORT TOPIC
"""

from __future__ import annotations

import math
import socket
import struct
import sys
import time
from typing import Dict, List, Tuple

import rospy
from xplane_bridge.msg import FlightState

_P = "sim/flightmodel/position/"
_FT = 0.3048
_KT = 0.5144444444

#: FlightState field, dataref, factor to SI.
_FIELDS: List[Tuple[str, str, float]] = [
    ("sim_time", "sim/time/total_running_time_sec", 1.0),
    ("frame_period", "sim/operation/misc/frame_rate_period", 1.0),
    ("paused", "sim/time/paused", 1.0),
    ("replay", "sim/time/is_in_replay", 1.0),
    ("latitude", _P + "latitude", 1.0),
    ("longitude", _P + "longitude", 1.0),
    ("altitude_msl", _P + "elevation", 1.0),
    ("altitude_agl", _P + "y_agl", 1.0),
    ("altitude_indicated", "sim/cockpit2/gauges/indicators/altitude_ft_pilot", _FT),
    ("altitude_pressure", "sim/flightmodel2/position/pressure_altitude", _FT),
    ("roll_deg", _P + "true_phi", 1.0),
    ("pitch_deg", _P + "true_theta", 1.0),
    ("heading_true_deg", _P + "true_psi", 1.0),
    ("heading_magnetic_deg", _P + "mag_psi", 1.0),
    ("declination_deg", _P + "magnetic_variation", -1.0),
    ("angular_velocity.x", _P + "Prad", 1.0),
    ("angular_velocity.y", _P + "Qrad", 1.0),
    ("angular_velocity.z", _P + "Rrad", 1.0),
    ("angular_acceleration.x", _P + "P_dot", math.radians(1.0)),
    ("angular_acceleration.y", _P + "Q_dot", math.radians(1.0)),
    ("angular_acceleration.z", _P + "R_dot", math.radians(1.0)),
    ("velocity_ned.y", _P + "local_vx", 1.0),
    ("velocity_ned.z", _P + "local_vy", -1.0),
    ("velocity_ned.x", _P + "local_vz", -1.0),
    ("indicated_airspeed", _P + "indicated_airspeed", _KT),
    ("true_airspeed", _P + "true_airspeed", 1.0),
    ("mach", "sim/flightmodel/misc/machno", 1.0),
    ("dynamic_pressure", "sim/flightmodel/misc/Qstatic", 47.88025898),
    ("air_density", "sim/weather/rho", 1.0),
    ("load_factor_normal", "sim/flightmodel/forces/g_nrml", 1.0),
    ("load_factor_axial", "sim/flightmodel/forces/g_axil", -1.0),
    ("load_factor_side", "sim/flightmodel/forces/g_side", 1.0),
    ("xplane_alpha_deg", _P + "alpha", 1.0),
    ("xplane_beta_deg", _P + "beta", 1.0),
    ("xplane_hpath_deg", _P + "hpath", 1.0),
    ("xplane_vpath_deg", _P + "vpath", 1.0),
    ("wind_ned.y", "sim/weather/wind_now_x_msc", 1.0),
    ("wind_ned.z", "sim/weather/wind_now_y_msc", -1.0),
    ("wind_ned.x", "sim/weather/wind_now_z_msc", -1.0),
    ("aero_moment.x", "sim/flightmodel/forces/L_aero", 1.0),
    ("aero_moment.y", "sim/flightmodel/forces/M_aero", 1.0),
    ("aero_moment.z", "sim/flightmodel/forces/N_aero", 1.0),
    ("control_roll", "sim/joystick/yoke_roll_ratio", 1.0),
    ("control_pitch", "sim/joystick/yoke_pitch_ratio", 1.0),
    ("control_yaw", "sim/joystick/yoke_heading_ratio", 1.0),
    ("control_throttle", "sim/cockpit2/engine/actuators/throttle_ratio[0]", 1.0),
    ("on_ground", "sim/flightmodel/failures/onground_any", 1.0),
]
_FLAGS = ("paused", "replay", "on_ground")
_RATE_HZ = 999
_SUBSCRIBE_S = 1.0


def _subscribe(link: socket.socket) -> None:
    for index, (_, path, _) in enumerate(_FIELDS):
        link.send(struct.pack("<5sii400s", b"RREF\0", _RATE_HZ, index, path.encode()))


def _assign(state: FlightState, name: str, value: float) -> None:
    if name in _FLAGS:
        setattr(state, name, value != 0.0)
    elif "." in name:
        vector, axis = name.split(".")
        setattr(getattr(state, vector), axis, value)
    else:
        setattr(state, name, value)


def _compute(state: FlightState) -> None:
    """What rx_node computes: quaternion, velocity in body axes, ground speed and track."""
    phi, theta, psi = (math.radians(a) for a in (state.roll_deg, state.pitch_deg, state.heading_true_deg))
    cr, sr, cp, sp = math.cos(phi / 2), math.sin(phi / 2), math.cos(theta / 2), math.sin(theta / 2)
    cy, sy = math.cos(psi / 2), math.sin(psi / 2)
    q = state.orientation
    q.w = cr * cp * cy + sr * sp * sy
    q.x = sr * cp * cy - cr * sp * sy
    q.y = cr * sp * cy + sr * cp * sy
    q.z = cr * cp * sy - sr * sp * cy
    n, e, d = state.velocity_ned.x, state.velocity_ned.y, state.velocity_ned.z
    c, s = math.cos, math.sin
    v = state.velocity_body
    v.x = c(theta) * c(psi) * n + c(theta) * s(psi) * e - s(theta) * d
    v.y = (s(phi) * s(theta) * c(psi) - c(phi) * s(psi)) * n
    v.y += (s(phi) * s(theta) * s(psi) + c(phi) * c(psi)) * e + s(phi) * c(theta) * d
    v.z = (c(phi) * s(theta) * c(psi) + s(phi) * s(psi)) * n
    v.z += (c(phi) * s(theta) * s(psi) - s(phi) * c(psi)) * e + c(phi) * c(theta) * d
    state.ground_speed = math.hypot(n, e)
    state.track_deg = math.degrees(math.atan2(e, n)) % 360.0
    state.vertical_speed = -d


def main() -> None:
    """Runs until the master asks it to end."""
    host, port, topic = rospy.myargv(sys.argv)[1:4]
    rospy.init_node("rospy_rx", anonymous=True)
    publisher = rospy.Publisher(topic, FlightState, queue_size=100, tcp_nodelay=True)
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.connect((host, int(port)))
    link.settimeout(0.2)
    state = FlightState()
    state.header.frame_id = "base_link_frd"
    pair = struct.Struct("<if")
    subscribed = -math.inf
    known: Dict[int, float] = {}
    while not rospy.is_shutdown():
        if not known and time.monotonic() - subscribed > _SUBSCRIBE_S:
            _subscribe(link)
            subscribed = time.monotonic()
        try:
            datagram = link.recv(65536)
        except (socket.timeout, ConnectionRefusedError):
            known.clear()
            continue
        state.header.stamp = rospy.Time.from_sec(time.time())
        known = dict(pair.iter_unpack(datagram[5:]))
        for index, (name, _, factor) in enumerate(_FIELDS):
            value = known.get(index)
            if value is not None:
                _assign(state, name, value * factor)
        _compute(state)
        publisher.publish(state)


if __name__ == "__main__":
    main()
