"""Buttons of a joystick beyond its commands: single surfaces, failures, views, pause and a new flight."""

from __future__ import annotations

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import RepeatedJoy, WatchedDatarefs, call, tx_params, write_mixing
from xplane_bridge.harness import wait_until

CONTROLS = "sim/flightmodel/controls/"
LEFT, ELEVATOR = CONTROLS + "wing2l_ail1def", CONTROLS + "hstab1_elv1def"
SURFACES = "sim/operation/override/override_control_surfaces"
PAUSED, FLIGHT = "sim/time/paused", "sim/time/total_flight_time_sec"
ENGINE = "sim/operation/failures/rel_engfai0"
STICK = {
    "device": "a stick with buttons",
    "joy_timeout": 10.0,  # a busy machine's stick may be silent for a moment
    "direct": {"roll": {"axis": 0}, "pitch": {"axis": 1}},
    "surfaces": {
        "aileron1_wing2_left": {"axis": 2, "select_button": 0, "low": -25.0, "high": 15.0, "dead_zone": 0.0},
        "elevator1_left": {"axis": 3, "rate": 2.0, "select_button": 1, "low": -9.0, "high": 6.0},
    },
    "functions": {
        "pause": {"button": 2, "does": "pause"},
        "astern": {"button": 3, "does": "view", "view": "rear"},
        "engine": {"button": 4, "does": "failure", "name": "engine_1", "kind": "failed"},
        "restart": {"button": 5, "does": "command", "command": "sim/operation/reset_flight"},
        "nonsense": {"button": 6, "does": "failure", "name": "wing", "kind": "failed"},
    },
}


@pytest.fixture
def stick(world):
    """The twin, flown by a stick that rests; its button `press`es."""
    write_mixing(world)
    world.xplane = world.emulator("--no-beacon", "--start", "air")
    world.wire = WatchedDatarefs(world.xplane.port, LEFT, ELEVATOR, SURFACES, PAUSED, FLIGHT, ENGINE)
    world.set_param("aircraft", "fixed_wing")
    world.set_param("stale_after", 5.0)  # a press asks once, and late frames are no lost link
    world.start("tx_node", tx_params(surfaces_source="manual"))
    world.start("rx_node")
    world.mapper = world.start("joystick_mapper_node", STICK)
    joy = RepeatedJoy(world, 4, 7)
    joy.plug_in()
    world.wait_for_diagnostics("surfaces", lambda s: "ready" in s.message, WAIT_S)

    def press(button):
        """A press that lasts until it has an effect is up to the test: it ends it with 0."""
        joy.buttons[button] = 1

    joy.press = press
    yield joy
    joy.pull_out()
    world.wire.close()


def hear(world):
    """The mapper has heard what the stick shows: its debounce has passed."""
    from xplane_bridge.msg import ControlCommand

    log = world.watch("control/manual", ControlCommand)
    log.wait_for_count(10, WAIT_S)
    log.close()


def release(joy, world):
    """Nothing is pressed any more."""
    joy.buttons[:] = [0] * len(joy.buttons)
    hear(world)


def reported(world, text):
    wait_until(lambda: text in world.mapper.output(), WAIT_S, f"{text!r} on the mapper's console")


def test_surfaces_are_chosen_set_and_given_back(stick, world):
    stick.press(0)
    world.wire.wait(SURFACES, 1.0, WAIT_S)
    stick.axes[2] = 0.4
    world.wire.wait(LEFT, 6.0, WAIT_S, tolerance=0.05)  # of 15 deg
    release(stick, world)
    stick.press(1)
    stick.axes[2], stick.axes[3] = 0.0, -1.0
    world.wire.wait(ELEVATOR, -9.0, WAIT_S, tolerance=0.05)
    world.wire.wait(LEFT, 6.0, WAIT_S, tolerance=0.05)  # stays where it was set
    stick.axes[3] = 0.0
    for button in (1, 0, 0):  # the one chosen; the first, to choose it again; and it, too
        release(stick, world)
        stick.press(button)
        hear(world)
    world.wire.wait(SURFACES, 0.0, WAIT_S)


def test_functions_ask_tx_node(stick, world):
    for value in (1.0, 0.0):
        stick.press(2)
        world.wire.wait(PAUSED, value, WAIT_S)
        release(stick, world)
    stick.press(3)
    reported(world, "functions.astern: done")
    for value in (6.0, 0.0):
        stick.press(4)
        world.wire.wait(ENGINE, value, WAIT_S)
        release(stick, world)
    stick.press(6)
    reported(world, "functions.nonsense: ")
    assert "functions.nonsense: done" not in world.mapper.output()
    wait_until(lambda: world.wire.value(FLIGHT) > 3.0, WAIT_S, "a flight of some seconds")
    stick.press(5)
    wait_until(lambda: min(world.wire.history(FLIGHT), default=3.0) < 3.0, WAIT_S, "a new flight")


def test_a_failure_that_another_client_repaired_fails_again_at_the_press_after_the_refused_one(stick, world):
    stick.press(4)
    world.wire.wait(ENGINE, 6.0, WAIT_S)
    release(stick, world)
    assert call(world, "clear_failures", "ClearFailures", names=["engine_1"]).success
    world.wire.wait(ENGINE, 0.0, WAIT_S)
    stick.press(4)
    reported(world, 'functions.engine: "engine_1" is not broken')
    assert world.wire.value(ENGINE) == 0.0
    release(stick, world)
    stick.press(4)
    world.wire.wait(ENGINE, 6.0, WAIT_S)


@pytest.mark.parametrize(
    ("code", "repair", "then"),
    [
        ("OK", "OK", ["clear"]),
        ("OK", "REFUSED", ["clear"]),
        ("ACCEPTED", "OK", ["clear"]),
        ("TIMEOUT", "OK", ["clear"]),
        ("TIMEOUT", "REFUSED", ["clear", "set"]),  # tx_node has given it up
        ("REFUSED", "OK", ["set"]),
        ("NO_LINK", "OK", ["set"]),
    ],
)
def test_the_next_press_repairs_all_that_may_be_broken(world, code, repair, then):
    import rospy
    from xplane_bridge.msg import ServiceResult
    from xplane_bridge.srv import ClearFailures, ClearFailuresResponse, SetFailure, SetFailureResponse

    asked = []

    def set_failure(_request):
        asked.append("set")
        return SetFailureResponse(code == "OK", ServiceResult(getattr(ServiceResult, code), f"it is {code}"))

    def clear_failures(request):
        asked.append("clear")
        answer = ServiceResult(getattr(ServiceResult, repair), f"the repair is {repair}")
        return ClearFailuresResponse(repair == "OK", answer, list(request.names))

    services = [
        rospy.Service(f"{world.namespace}/tx_node/set_failure", SetFailure, set_failure),
        rospy.Service(f"{world.namespace}/tx_node/clear_failures", ClearFailures, clear_failures),
    ]
    world.mapper = world.start("joystick_mapper_node", STICK)
    joy = RepeatedJoy(world, 4, 7)
    joy.plug_in()
    try:
        for calls in (["set"], ["set", *then]):
            hear(world)
            joy.buttons[4] = 1
            wait_until(lambda expected=calls: len(asked) >= len(expected), WAIT_S, f"the calls {calls}")
            release(joy, world)
    finally:
        joy.pull_out()
        for service in services:
            service.shutdown()
    assert asked == ["set", *then]
    reported(world, "functions.engine: done" if code == "OK" else f"functions.engine: it is {code}")


@pytest.mark.parametrize(
    ("section", "words"),
    [
        (
            {"surfaces": {"wing": {"axis": 0, "select_button": 0, "low": 0.0, "high": 1.0}}},
            'there is no surface "wing"',
        ),
        ({"functions": {"f": {"button": 0, "does": "fly"}}}, "functions/f/does"),
        ({"functions": {"f": {"button": 0, "does": "view", "view": "up"}}}, "functions/f/view"),
        ({"functions": {"f": {"button": 0, "does": "failure", "name": "engine_1"}}}, "functions/f/kind"),
    ],
)
def test_a_wrong_key_stops_the_node_in_words(world, section, words):
    node = world.start("joystick_mapper_node", {"device": "x", **section})
    assert node.wait(WAIT_S) == 1
    assert words in node.output()
