"""Every channel of ControlCommand moves what it is for in the simulator, and is given back as it was.

A parked aircraft moves by nothing else. Deflections are worked out by hand from the travel of the emulator's twin:
ailerons 25 deg up and 15 down, elevators 18 and 13, rudder 27, flaps 42, speed brakes 60; full trim is 0.3, 0.7, 0.4
of full stick.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import CommandSource, WatchedDatarefs, tx_params
from xplane_bridge.constants import ControlField

COCKPIT = "sim/cockpit2/controls/"
SURFACES = "sim/flightmodel/controls/"
LEVERS = "sim/cockpit2/engine/actuators/throttle_ratio"
USED = "sim/flightmodel2/engines/throttle_used_ratio"
OVERRIDE = "sim/operation/override/override_"
#: Nacelles go 8 deg/s, flaps 7 deg/s, and the machine may be busy.


def engines(dataref, *values):
    """A value for each engine."""
    return {f"{dataref}[{i}]": value for i, value in enumerate(values)}


@dataclass(frozen=True)
class Case:
    """One channel: what is commanded, where it is written, and what moves by it."""

    command: dict
    written: dict  #: dataref: value
    moves: dict = field(default_factory=dict)  #: dataref that the flight model computes: value
    override: str = ""
    rest: dict = field(default_factory=dict)  #: commanded afterwards; what is not named: 0
    flight: str = "fixed_wing parked"


def stick(name, leaf, value, moves):
    """An axis of the stick."""
    return Case({name: value}, {f"sim/joystick/yoke_{leaf}_ratio": value}, moves, f"joystick_{leaf}")


def handle(name, dataref, value, **more):
    """A handle in the cockpit."""
    return Case({name: value}, {COCKPIT + dataref: value}, **more)


def surfaces(**deflections):
    """By leaf."""
    return {f"{SURFACES}{name}def": value for name, value in deflections.items()}


F = ControlField
CASES = {
    F.ROLL: stick("roll", "roll", 0.5, surfaces(wing2l_ail1=7.5, wing2r_ail1=-12.5)),
    F.PITCH: stick("pitch", "pitch", 0.5, surfaces(hstab1_elv1=-9.0, hstab2_elv1=-9.0)),
    F.YAW: stick("yaw", "heading", -0.5, surfaces(vstab1_rud1=-13.5)),
    F.THROTTLE: Case({"throttle": 0.3}, engines(LEVERS, 0.3, 0.3), engines(USED, 0.3, 0.3)),
    F.ENGINE_THROTTLES: Case(
        {"engine_count": 2, "engine_throttles": [0.2, 0.4] + [0.0] * 6},
        engines(LEVERS, 0.2, 0.4),
        engines(USED, 0.2, 0.4),
        rest={"engine_count": 2, "engine_throttles": [0.0] * 8},
    ),
    F.MOTORS: Case(
        {"engine_count": 4, "motors": [0.1, 0.05, 0.15, 0.2] + [0.0] * 4},
        engines("sim/flightmodel/engine/ENGN_thro_use", 0.1, 0.05, 0.15, 0.2),
        engines(USED, 0.1, 0.05, 0.15, 0.2),
        "throttles",
        rest={"engine_count": 4, "motors": [0.0] * 8},
        flight="multirotor parked",
    ),
    F.TRIM_ROLL: handle("trim_roll", "aileron_trim", 0.5, moves=surfaces(wing2l_ail1=2.25, wing2r_ail1=-2.25)),
    F.TRIM_PITCH: handle("trim_pitch", "elevator_trim", 0.5, moves=surfaces(hstab1_elv1=-6.3, hstab2_elv1=-6.3)),
    F.TRIM_YAW: handle("trim_yaw", "rudder_trim", 0.5, moves=surfaces(vstab1_rud1=5.4)),
    F.FLAPS: handle("flaps", "flap_ratio", 0.5, moves=surfaces(wing1l_fla1=21.0, wing1r_fla1=21.0)),
    F.SPEEDBRAKE: handle("speedbrake", "speedbrake_ratio", 0.5, moves=surfaces(wing1l_spo1=30.0, wing1r_spo1=30.0)),
    F.GEAR: handle(
        "gear",
        "gear_handle_down",
        1.0,
        moves={"sim/flightmodel2/gear/deploy_ratio[0]": 1.0},
        flight="fixed_wing in the air",
    ),
    F.PARKING_BRAKE: handle("parking_brake", "parking_brake_ratio", 0.5, rest={"parking_brake": 1.0}),
    F.TOE_BRAKES: Case(
        {"left_brake": 0.25, "right_brake": 0.75},
        {COCKPIT + "left_brake_ratio": 0.25, COCKPIT + "right_brake_ratio": 0.75},
        override="toe_brakes",
    ),
    F.THRUST_VECTOR: handle(
        "thrust_vector",
        "thrust_vector_ratio",
        0.7,
        moves={"sim/flightmodel2/controls/thrust_vector_ratio": 0.7},
        rest={"thrust_vector": 0.9},
        flight="tiltrotor parked",
    ),
}


@pytest.fixture(scope="module")
def flights(new_world, tmp_path_factory):
    """Starts an aircraft when it is asked for first."""
    from xplane_bridge.msg import AppliedCommand, EventList

    started = {}

    def start(flight):
        if flight in started:
            return started[flight]
        aircraft, where = flight.split(" ", 1)
        world = new_world(tmp_path_factory.mktemp(aircraft))
        started[flight] = world
        world.xplane = world.emulator(
            "--no-beacon", "--aircraft", aircraft, "--start", "ground" if where == "parked" else "air"
        )
        world.applied = world.watch("control/applied", AppliedCommand)
        world.events = world.watch("events", EventList)
        world.set_param("aircraft", aircraft)
        world.start("tx_node", tx_params(aircraft, command_timeout=5.0))
        world.events.wait_for(lambda e: any(event.text.startswith("aircraft:") for event in e.events), 60.0)
        world.manual = CommandSource(world, "control/manual")
        return world

    yield start
    for world in started.values():
        world.manual.stop()
        world.close()


def shows(applied, command):
    """Whether an AppliedCommand has all of these values that it has fields for."""
    names = [name for name in command if hasattr(applied, name) and name != "engine_count"]
    return all(getattr(applied, name) == pytest.approx(command[name]) for name in names)


def test_every_field_of_the_command_is_in_a_case():
    from xplane_bridge.msg import ControlCommand

    commanded = {name for case in CASES.values() for name in case.command}
    assert commanded == set(ControlCommand.__slots__) - {"header", "sequence", "fields"}


@pytest.mark.parametrize("channel", list(ControlField), ids=lambda channel: channel.name.lower())
def test_channel_moves_what_it_is_for(flights, channel):
    assert channel in CASES, f"ControlCommand has a new channel, {channel.name}: write its case here"
    case = CASES[channel]
    world = flights(case.flight)
    override = [OVERRIDE + case.override] if case.override else []
    watched = WatchedDatarefs(world.xplane.port, *case.written, *case.moves, *override)
    try:
        world.manual.fly(fields=channel, **case.command)
        for path, value in {**case.written, **case.moves}.items():
            watched.wait(path, value, WAIT_S, tolerance=2e-3 if path in case.written else 0.02)
        assert [watched.value(path) for path in override] == [1.0] * len(override)
        # A source that was silent for too long is the failsafe's first, which X-Plane shows as well.
        world.applied.wait_for_next(
            lambda a: a.read_back and a.fields & channel and shows(a, case.command), what=f"{case.command}"
        )
        # And back.
        rest = {**dict.fromkeys(case.command, 0.0), **case.rest}
        world.manual.fly(**rest)
        path, name = next(iter(case.written)), next(iter(set(case.command) - {"engine_count"}))
        value = rest[name]
        watched.wait(path, value if isinstance(value, float) else value[0], WAIT_S, tolerance=2e-3)
    finally:
        watched.close()


def test_a_trim_that_the_aircraft_has_not_is_refused_in_words(flights):
    world = flights("multirotor parked")
    world.manual.fly(fields=F.ROLL | F.TRIM_YAW, roll=0.1, trim_yaw=0.5)
    said = world.events.wait_for(lambda e: any("trim_yaw is not sent" in event.text for event in e.events), WAIT_S)
    event = next(event for event in said.events if "trim_yaw is not sent" in event.text)
    assert not event.success
    assert "this aircraft has no rudder trim (sim/aircraft/controls/acf_max_trim_rudd, sim/" in event.text
    # What was sent before X-Plane had shown its trims may still be read back.
    both = F.ROLL | F.TRIM_YAW  # flights before this one may have left others
    world.applied.wait_for_next(lambda a: a.read_back and a.fields & both == F.ROLL, WAIT_S)
    world.manual.fly(trim_yaw=0.7)
    applied = world.applied.wait_for_count(20)
    assert {a.fields & both for a in applied} == {F.ROLL}
    assert world.wire(world.xplane.port).read(COCKPIT + "rudder_trim") != pytest.approx(0.7, abs=0.01)
    world.manual.fly(roll=0.0, trim_yaw=0.0)
