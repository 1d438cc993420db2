"""What datarefs keep when another aircraft is loaded: nothing of the one before."""

from __future__ import annotations

import pytest

from support.simulator.emulator_bench import (
    OVERRIDE,
    fixture_bench,  # noqa: F401
)
from xplane_bridge import protocol

ENGINE, ACTUATORS = "sim/flightmodel/engine/", "sim/cockpit2/engine/actuators/"


def load(emulator, name):
    """Asks for another aircraft, which the next frame has."""
    emulator.client().send(protocol.AircraftLoad(0, f"Aircraft/xplane_bridge/{name}/{name}.acf"))
    emulator.step()
    assert emulator.sim.aircraft == name


def test_elements_that_the_new_aircraft_lacks_are_0(bench):
    emulator = bench(aircraft="multirotor")
    of_engines = [f"{ENGINE}{name}[3]" for name in ("ENGN_running", "ENGN_tacrad", "POINT_thrust")]
    switches = [ACTUATORS + f"{name}[3]" for name in ("fuel_pump_on", "igniter_on", "ignition_on", "ignition_key")]
    switches += ["sim/cockpit2/electrical/generator_on[3]", ENGINE + "ENGN_propmode[3]"]
    names = [*of_engines, *switches, "sim/flightmodel2/gear/deploy_ratio[3]", ACTUATORS + "throttle_ratio[3]"]
    assert min(emulator.read(*names)) > 0.0
    load(emulator, "fixed_wing")  # two engines, three legs
    assert emulator.read(*names) == [0.0] * len(names)
    assert emulator.read(ENGINE + "ENGN_running[1]", ACTUATORS + "throttle_ratio[1]") == [
        1.0,
        pytest.approx(0.62, abs=0.1),
    ]


def test_tanks_that_the_new_aircraft_lacks_are_empty(bench):
    emulator = bench(aircraft="fixed_wing")
    tanks = [f"sim/flightmodel/weight/m_fuel[{tank}]" for tank in (0, 1)]
    assert min(emulator.read(*tanks)) > 90.0
    load(emulator, "multirotor")
    assert emulator.read(*tanks) == [0.0, 0.0]


def test_the_servos_of_an_aircraft_without_autopilot_rest(bench):
    emulator = bench(aircraft="fixed_wing")
    for command in ("servos_on", "heading"):
        emulator.client().send(protocol.CommandRequest("sim/autopilot/" + command))
    emulator.write({"sim/cockpit2/autopilot/heading_dial_deg_mag_pilot": 180.0})
    emulator.step(30)
    servo = "sim/joystick/servo_roll_ratio"
    assert emulator.read(servo) != [0.0]
    load(emulator, "multirotor")
    assert emulator.read(servo) == [0.0]


def test_the_old_names_of_surfaces_are_those_of_the_loaded_aircraft(bench):
    emulator = bench(aircraft="fixed_wing")
    old, inner, outer = (f"sim/flightmodel/controls/{name}def" for name in ("lail1", "wing1l_ail1", "wing2l_ail1"))
    emulator.write({OVERRIDE + "control_surfaces": 1.0, old: 5.0})
    assert emulator.read(old, inner, outer) == [5.0, 0.0, 5.0]
    load(emulator, "tiltrotor")
    emulator.write({inner: 3.0, old: 12.0})
    assert emulator.read(old, inner, outer) == [12.0, 12.0, 0.0]
    emulator.write({inner: 3.0})
    assert emulator.read(old, inner, outer) == [3.0, 3.0, 0.0]
    load(emulator, "multirotor")
    assert emulator.read(old, inner, outer) == [0.0, 0.0, 0.0]


def test_the_pilots_head_is_where_the_new_aircraft_has_the_eye(bench):
    emulator = bench(aircraft="fixed_wing")
    names = [f"sim/graphics/view/pilots_head_{axis}" for axis in "xyz"]
    names += [f"sim/aircraft/view/acf_pe{axis}" for axis in "XYZ"]
    assert emulator.read(*names) == pytest.approx([0.0, 0.65, -0.6] * 2)
    load(emulator, "tiltrotor")
    assert emulator.read(*names) == pytest.approx([0.0, 0.2, -2.0] * 2)
