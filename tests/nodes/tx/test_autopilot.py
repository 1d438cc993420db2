"""set_autopilot of tx_node: the twin flies by X-Plane's own autopilot, and other aircraft are refused in words."""

from __future__ import annotations

import contextlib
import signal

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import ROLL, CommandSource, call, journal_entries, tx_params
from xplane_bridge.harness import wait_until

ACCEPTED, REFUSED = 1, 2
AIRCRAFT, SETTING = 3, 11
AP = "sim/cockpit2/autopilot/"
GAUGES = "sim/cockpit2/gauges/indicators/"
FLY_S = 240.0  # of a busy machine, for a minute and a half of flight


@contextlib.contextmanager
def flown(world, *options, aircraft="fixed_wing", setting_timeout=30.0):
    """Emulator without a pilot, and tx_node."""
    from xplane_bridge.msg import EventList

    world.xplane = world.emulator("--no-beacon", "--start", "air", "--aircraft", aircraft, *options)
    world.other = world.wire(world.xplane.port)
    world.events = world.watch("events", EventList)
    world.set_param("aircraft", aircraft)
    world.node = world.start("tx_node", tx_params(aircraft, setting_timeout=setting_timeout))
    world.events.wait_for(lambda e: any(event.kind == AIRCRAFT for event in e.events), 60.0)
    yield world


def ask(world, **request):
    """The event with the outcome."""
    response = call(world, "set_autopilot", "SetAutopilot", **request)
    assert (response.success, response.result.code) == (True, ACCEPTED), response.result.message
    number = response.event_number
    reported = world.events.wait_for(lambda e: any(event.number == number for event in e.events), 60.0)
    event = next(event for event in reported.events if event.number == number)
    assert (event.kind, event.requested_by.rsplit("/", 1)[-1]) == (SETTING, "set_autopilot")
    return event


def done(world, **request):
    event = ask(world, **request)
    assert event.success, event.text
    return event


def bits(*names):
    from xplane_bridge.srv import SetAutopilotRequest

    return sum(getattr(SetAutopilotRequest, name) for name in names)


@pytest.mark.parametrize("version", ["11.40", "12"])
def test_heading_altitude_and_speed_are_captured(world, version):
    from xplane_bridge.srv import SetAutopilotRequest as Request

    with flown(world, "--version", version):
        read = world.other.read
        begin = read(GAUGES + "heading_AHARS_deg_mag_pilot")
        heading = (begin + 60.0) % 360.0
        event = done(
            world,
            fields=bits(
                "MASTER", "LATERAL", "VERTICAL", "ALTITUDE_ARMED", "AUTOTHROTTLE", "YAW_DAMPER",
                "HEADING", "ALTITUDE", "VERTICAL_SPEED", "AIRSPEED",
            ),
            master=Request.SERVOS, lateral=Request.HEADING_SELECT, vertical=Request.VERTICAL_SPEED_HOLD,
            altitude_armed=True, autothrottle=True, yaw_damper=True,
            heading_magnetic_deg=heading, altitude=1060.0, vertical_speed=2.5, airspeed=66.0,
        )  # fmt: skip
        assert event.text == "the autopilot is set as asked for"
        assert read(AP + "servos_on") == 1.0
        assert read("sim/cockpit2/switches/yaw_damper_on") == 1.0
        # 1 ft is 0.3048 m, 1 kt 0.514444 m/s, 1 ft/min 0.00508 m/s.
        assert read(AP + "altitude_dial_ft") == pytest.approx(3477.69, abs=0.01)
        assert read(AP + "vvi_dial_fpm") in (pytest.approx(492.126, abs=0.01), 0.0), "0: captured already"
        wait_until(lambda: read(AP + "altitude_hold_status") == 2.0, FLY_S, "the altitude's capture")
        wait_until(
            lambda: (
                abs((read(GAUGES + "heading_AHARS_deg_mag_pilot") - heading + 180.0) % 360.0 - 180.0) < 1.0
                and abs(read(GAUGES + "altitude_ft_pilot") - 3477.69) < 20.0
                and abs(read(GAUGES + "airspeed_kts_pilot") - 128.294) < 4.0
            ),
            FLY_S,
            "heading, altitude and speed of the dials",
        )
        assert read("sim/operation/override/override_joystick_roll") == 0.0
        assert not journal_entries(world), "nothing was to be put back"


def test_what_cannot_be_is_refused(world):
    with flown(world):
        for request, words in (
            ({}, "nothing is given"),
            ({"fields": bits("LATERAL"), "lateral": 9}, "lateral is 9: expected WING_LEVEL"),
            ({"fields": bits("AIRSPEED"), "airspeed": 5.0}, "airspeed is 5: expected 10..600 [m/s]"),
        ):
            response = call(world, "set_autopilot", "SetAutopilot", **request)
            assert (response.success, response.result.code, response.event_number) == (False, REFUSED, 0)
            assert words in response.result.message
        manual = CommandSource(world, "control/manual")
        try:
            manual.fly(fields=ROLL, roll=0.0)
            wait_until(
                lambda: world.other.read("sim/operation/override/override_joystick_roll") == 1.0, WAIT_S, "the override"
            )
            event = done(world, fields=bits("MASTER"), master=2)
            assert "tx_node holds override_joystick_roll, and there the autopilot moves nothing" in event.text
        finally:
            manual.stop()


def test_an_aircraft_without_one_is_reported(world):
    with flown(world, aircraft="multirotor", setting_timeout=5.0):  # it waits for the time-out
        event = ask(world, fields=bits("MASTER"), master=2)
        assert not event.success
        assert 'does not engage "servos"' in event.text
        assert "has this aircraft an autopilot with it" in event.text


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL], ids=["asked", "killed"])
def test_what_was_to_end_with_the_node_does(world, end):
    with flown(world):
        fields = bits("MASTER", "LATERAL", "HEADING", "AUTOTHROTTLE")
        dial = AP + "heading_dial_deg_mag_pilot"
        before = world.other.read(dial)
        done(
            world,
            fields=fields,
            master=2,
            lateral=2,
            autothrottle=True,
            heading_magnetic_deg=77.0,
            restore_on_exit=True,
        )
        assert world.other.read(dial) == 77.0
        world.node.send_signal(end)
        for name, value in ((dial, before), (AP + "flight_director_mode", 0.0), (AP + "autothrottle_enabled", 0.0)):
            wait_until(lambda name=name, value=value: world.other.read(name) == value, 60.0, name)
