"""What RPOS says of a frame."""

from __future__ import annotations

from xplane_bridge.emulator.flight.frame import Frame
from xplane_bridge.protocol import RposResponse

#: Before the first flight.
NOWHERE = RposResponse(*([0.0] * 13))


def response(frame: Frame, level: bool) -> RposResponse:
    """The place, attitude, velocity and rates of a frame.

    Args:
        frame: It.
        level: Whether the attitude is that of the level where the aircraft is; else that of the origin's.
    """
    f, m = frame, frame.m
    return RposResponse(
        m.longitude_deg,
        m.latitude_deg,
        m.altitude_m,
        f.height,
        f.true_theta if level else f.theta,
        f.true_psi if level else f.psi,
        f.true_phi if level else f.phi,
        *f.velocity,
        m.p_rad_s,
        m.q_rad_s,
        m.r_rad_s,
    )
