"""Failed brakes hold by neither pedal nor parking brake; a side that works holds by both."""

from __future__ import annotations

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.failure_effects import FailureEffects
from xplane_bridge.emulator.flight.flight_model import Controls, InitialState

FAILURES = "sim/operation/failures/"
PARKING = "sim/cockpit2/controls/parking_brake_ratio"
SPEED = "sim/flightmodel/position/groundspeed"


@pytest.mark.parametrize("aircraft", ["fixed_wing", "kinematic"])
def test_the_parking_brake_does_not_hold_wheels_whose_brakes_have_failed(aircraft: str) -> None:
    with EmulatorFixture(aircraft=aircraft, initial=InitialState(on_ground=True, engines_running=True)) as emulator:
        emulator.write({PARKING: 1.0, "sim/cockpit2/engine/actuators/throttle_ratio_all": 0.5})
        emulator.step(60)
        (standing,) = emulator.read(SPEED)
        emulator.write({FAILURES + "rel_lbrakes": 6.0, FAILURES + "rel_rbrakes": 6.0})
        emulator.step(180)
        speed, lever = emulator.read(SPEED, PARKING)
        assert (standing < 0.05, speed > 2.0, lever) == (True, True, 1.0), (standing, speed)
        emulator.write({FAILURES + "rel_lbrakes": 0.0, FAILURES + "rel_rbrakes": 0.0})
        emulator.write({"sim/cockpit2/engine/actuators/throttle_ratio_all": 0.0})
        emulator.step(300)
        assert emulator.read(SPEED) == [pytest.approx(0.0, abs=0.05)]


def test_the_side_that_works_brakes_by_whichever_is_stronger() -> None:
    model = create_model("fixed_wing")
    for pedal, force in ((0.3, 0.8), (0.9, 0.9)):
        controls = Controls(parking_brake=0.8, brake_left=pedal, brake_right=pedal)
        FailureEffects().apply(controls, {"rel_rbrakes"}, model, 0.02)
        assert (controls.parking_brake, controls.brake_left, controls.brake_right) == (0.0, force, 0.0)
