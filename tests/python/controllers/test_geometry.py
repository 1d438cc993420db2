"""Places, legs and simulator time, by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from xplane_bridge.controllers.geometry import EARTH_RADIUS_M, Field, Leg, Pace, Place, turn_to


def state(north: float = 0.0, east: float = 0.0, **more: Any) -> SimpleNamespace:
    """A FlightState so many metres from 60 degrees north, 179.999 degrees east."""
    latitude = 60.0 + math.degrees(north / EARTH_RADIUS_M)
    longitude = 179.999 + math.degrees(east / (EARTH_RADIUS_M * 0.5))  # the parallel of 60 degrees is half as long
    values = {"heading_true_deg": 90.0, "altitude_msl": 12.0, "velocity_ned": SimpleNamespace(x=3.0, y=4.0, z=0.0)}
    return SimpleNamespace(latitude=latitude, longitude=math.remainder(longitude, 360.0), **{**values, **more})


def test_a_field_has_its_axes_along_the_first_heading_also_across_the_date_line() -> None:
    field = Field(state())
    assert field.place(state(north=30.0, east=400.0)) == pytest.approx((400.0, -30.0), abs=1e-3)  # 400 m: beyond 180
    assert field.velocity(state()) == pytest.approx((4.0, -3.0))
    assert field.altitude == 12.0


def test_a_leg_knows_how_far_along_and_how_far_to_the_right() -> None:
    leg = Leg(Field(state()), Place(0.0, 0.0), Place(300.0, 400.0))
    assert leg.length == 500.0
    assert leg.course_deg == pytest.approx(90.0 + 53.130102)
    beside = Place(300.0 - 8.0, 400.0 + 6.0)  # ten metres to the right of its end
    assert (leg.along(beside), leg.across(beside)) == pytest.approx((500.0, 10.0))


def test_time_goes_on_by_the_simulator_and_never_by_a_gap() -> None:
    pace = Pace()
    steps = [pace.step(SimpleNamespace(sim_time_unwrapped=time)) for time in (5.0, 5.02, 9.0, 8.0)]
    assert steps == pytest.approx([0.0, 0.02, 0.1, 0.0])


@pytest.mark.parametrize(("wanted", "present", "turn"), [(10, 350, 20), (350, 10, -20), (90, 90, 0)])
def test_turns_go_the_shorter_way(wanted: float, present: float, turn: float) -> None:
    assert turn_to(wanted, present) == pytest.approx(turn)
