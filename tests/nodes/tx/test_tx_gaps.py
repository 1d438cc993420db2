"""X-Plane silent for a while under tx_node: STALE keeps what is held, LOST takes it again or gives it back."""

from __future__ import annotations

import signal
import threading

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import (
    AUTO,
    ROLL,
    CommandSource,
    WatchedDatarefs,
    call,
    journal_entries,
    tx_params,
    write_mixing,
)
from xplane_bridge.harness import wait_until

SURFACES = "sim/operation/override/override_control_surfaces"
OVERRIDE = "sim/operation/override/override_joystick_roll"
STICK = "sim/joystick/yoke_roll_ratio"
LEFT = "sim/flightmodel/controls/wing2l_ail1def"


class SurfaceSource:
    """Publishes a SurfaceCommand again and again."""

    def __init__(self, world):
        import rospy
        from xplane_bridge.msg import SurfaceCommand

        self._message = SurfaceCommand(names=["aileron1_wing2_left"], deflections_deg=[4.0])
        self._publisher = rospy.Publisher(f"{world.namespace}/control/surfaces", SurfaceCommand, queue_size=1)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._repeat, daemon=True)
        self._thread.start()

    def _repeat(self):
        while not self._ended.wait(0.05):
            self._message.sequence += 1
            self._publisher.publish(self._message)

    def stop(self):
        self._ended.set()
        self._thread.join(10)


@pytest.fixture
def flight(world, request):
    """The left aileron held at 4 deg by control/surfaces, the stick by control/auto; parameters as a test wants."""
    from xplane_bridge.msg import EventList

    write_mixing(world)
    pilot = world.folder / "pilot.yaml"
    pilot.write_text("name: level\nevents: [{at: 0, hold: {roll: 0, altitude: 1000, speed: 72}}]\n", encoding="utf-8")
    world.xplane = world.emulator("--no-beacon", "--start", "air", "--pilot", pilot)
    world.seen = WatchedDatarefs(world.xplane.port, SURFACES, OVERRIDE, STICK, LEFT)
    world.events = world.watch("events", EventList)
    world.set_param("aircraft", "fixed_wing")
    wanted = {"lost_after": 1.0, "command_timeout": 0.5, **getattr(request, "param", {})}
    world.set_param("lost_after", wanted["lost_after"])
    world.start("tx_node", tx_params(command_timeout=wanted["command_timeout"]))
    world.wait_for_diagnostics("surfaces", lambda s: "ready" in s.message)
    assert call(world, "set_mode", "SetMode", mode=AUTO).success
    world.controller = CommandSource(world, "control/auto")
    world.controller.fly(fields=ROLL, roll=0.1)
    world.surfaces = SurfaceSource(world)
    world.seen.wait(LEFT, 4.0)
    world.seen.wait(OVERRIDE, 1.0)
    yield world
    world.xplane.send_signal(signal.SIGCONT)
    world.controller.stop()
    world.surfaces.stop()
    world.seen.close()


def gap(world, until):
    """X-Plane stands still until the node has said so."""
    world.events.skip_to_now()
    world.xplane.send_signal(signal.SIGSTOP)
    world.events.then_wait_for_event(lambda event: event.text.startswith(until), what=until)


def go_on(world):
    """X-Plane flies on."""
    world.xplane.send_signal(signal.SIGCONT)
    world.events.then_wait_for_event(lambda event: event.text.startswith("CONNECTED"), what="CONNECTED")


def texts(world):
    """All that has happened."""
    return [event.text for event in world.events.last.events]


# Long enough for a busy machine to be late with everything by some seconds.
@pytest.mark.parametrize("flight", [{"lost_after": 10.0, "command_timeout": 5.0}], indirect=True)
def test_stale_keeps_what_is_held(flight):
    taken = OVERRIDE.rpartition("/")[2]
    wait_until(lambda: any(t.startswith("overrides: set") and taken in t for t in texts(flight)), WAIT_S, taken)
    wait_until(lambda: any("the surfaces are driven" in t for t in texts(flight)), WAIT_S, "driven surfaces")
    before = texts(flight)
    gap(flight, "STALE")
    go_on(flight)
    for path, value in ((SURFACES, 1.0), (OVERRIDE, 1.0), (LEFT, 4.0), (STICK, 0.1)):
        flight.seen.wait(path, value)
    said = texts(flight)[len(before) :]
    assert all(text.startswith(("STALE", "CONNECTED")) for text in said), said
    assert sorted(journal_entries(flight)) == ["override:" + SURFACES, "override:" + OVERRIDE]


def test_lost_takes_again_what_is_still_commanded(flight):
    gap(flight, "LOST")
    go_on(flight)
    for path, value in ((SURFACES, 1.0), (OVERRIDE, 1.0), (LEFT, 4.0), (STICK, 0.1)):
        flight.seen.wait(path, value)
    assert sorted(journal_entries(flight)) == ["override:" + SURFACES, "override:" + OVERRIDE]
    # Shown to be held: the next command moves it.
    flight.controller.fly(roll=-0.1)
    flight.seen.wait(STICK, -0.1)


def test_lost_gives_back_what_is_not_commanded_any_more(flight):
    gap(flight, "LOST")
    flight.controller.stop()
    flight.surfaces.stop()
    for _ in range(2):  # diagnostics come once a second: longer than command_timeout
        flight.wait_for_diagnostics("control")
    go_on(flight)
    flight.seen.wait(SURFACES, 0.0)
    flight.seen.wait(OVERRIDE, 0.0)
    wait_until(lambda: not journal_entries(flight), WAIT_S, "an empty journal")
