"""X-Plane's field of view: the user's own comes back after several nodes' changes; what it does not fit is flagged."""

from __future__ import annotations

import contextlib
import re
import socket
import threading
from typing import ContextManager

import pytest

from support.deadlines import WAIT_S
from support.meanwhile import meanwhile
from support.nodes.tx_fixtures import call, journal_entries, tx_params
from xplane_bridge import protocol
from xplane_bridge.eye.wire import encode_hello, encode_status
from xplane_bridge.harness import ManagedProcess, wait_until
from xplane_bridge.harness.ports import free_tcp_port

pytestmark = pytest.mark.usefixtures("screen")

FIELD_OF_VIEW = "sim/graphics/view/field_of_view_deg"
USERS_DEG, CAPTURES_DEG, VIEWS_DEG = 72.0, 40.0, 60.0
FPS = 20


def users_wire(world):
    """Emulator with a window and the user's own field of view."""
    wire = world.wire(world.emulator("--window", "--fps", FPS, "--start", "air").port)
    wire.send(protocol.DrefWrite(FIELD_OF_VIEW, USERS_DEG))
    wire.wait_until_reads(FIELD_OF_VIEW, USERS_DEG)
    return wire


def set_view(world, **request: float) -> None:
    """Calls it until it is answered OK: it asks for a journal, and for X-Plane to show the view within a second."""
    wait_until(lambda: call(world, "set_view", "SetView", **request).result.code == 0, WAIT_S, "the view")


@pytest.mark.parametrize("ends", ["capture first", "tx first", "at once"])
@pytest.mark.parametrize("first", ["capture_node", "tx_node"])
def test_the_last_of_two_nodes_gives_the_users_own_back(world, display: str, first: str, ends: str) -> None:
    wire = users_wire(world)
    options = {"window": {"display": display}, "set_field_of_view": True, "field_of_view_deg": CAPTURES_DEG}
    nodes = {}
    for name in ("capture_node", "tx_node") if first == "capture_node" else ("tx_node", "capture_node"):
        nodes[name] = world.start(name, options if name == "capture_node" else tx_params())
        if name == "tx_node":
            set_view(world, view=1, field_of_view_deg=VIEWS_DEG)
        wire.wait_until_reads(FIELD_OF_VIEW, VIEWS_DEG if name == "tx_node" else CAPTURES_DEG)
    shown = wire.read(FIELD_OF_VIEW)
    order = ("tx_node", "capture_node") if ends == "tx first" else ("capture_node", "tx_node")
    if ends == "at once":
        stops = [threading.Thread(target=nodes[name].stop) for name in order]
        for stop in stops:
            stop.start()
        for stop in stops:
            stop.join()
    else:
        nodes[order[0]].stop()
        assert wire.read(FIELD_OF_VIEW) == shown, "the other node still holds it"
        nodes[order[1]].stop()
    wire.wait_until_reads(FIELD_OF_VIEW, USERS_DEG)
    assert not journal_entries(world)


def calibrate(world, camera: str = ""):
    from std_srvs.srv import Trigger

    return world.call(f"{camera}capture_node/calibrate_display_delay", Trigger)


def test_a_step_of_a_calibration_is_not_taken_for_the_users_own(world, display: str) -> None:
    from xplane_bridge.msg import FrameState

    wire = users_wire(world)
    capture = world.start("capture_node", {"window": {"display": display, "search_period": 0.05}})
    tx = world.start("tx_node", tx_params())
    call(world, "run_command", "RunCommand", name="sim/view/forward_with_nothing")  # it has a link
    states = world.watch("camera/frame_state", FrameState)
    states.wait_for(lambda state: abs(state.field_of_view_deg - USERS_DEG) < 1e-3, timeout=60.0)
    calibrating = threading.Thread(target=calibrate, args=(world,))
    calibrating.start()
    wait_until(lambda: wire.read(FIELD_OF_VIEW) > USERS_DEG, 60.0, "a step of the field of view")
    call(world, "set_view", "SetView", view=1)
    call(world, "set_view", "SetView", view=1, field_of_view_deg=VIEWS_DEG)  # which the next step may undo
    calibrating.join()
    set_view(world, view=1, field_of_view_deg=VIEWS_DEG)
    capture.stop()
    tx.stop()
    wire.wait_until_reads(FIELD_OF_VIEW, USERS_DEG)
    assert not journal_entries(world)


def test_a_view_that_ends_amid_a_calibration_leaves_the_users_own(world, display: str) -> None:
    from xplane_bridge.msg import FrameState

    wire = users_wire(world)
    tx = world.start("tx_node", tx_params())
    set_view(world, view=1, field_of_view_deg=VIEWS_DEG)
    capture = world.start("capture_node", {"window": {"display": display, "search_period": 0.05}})
    states = world.watch("camera/frame_state", FrameState)
    states.wait_for(lambda state: abs(state.field_of_view_deg - VIEWS_DEG) < 1e-3, timeout=60.0)
    calibrating = threading.Thread(target=calibrate, args=(world,))
    calibrating.start()
    wait_until(lambda: wire.read(FIELD_OF_VIEW) > VIEWS_DEG, 60.0, "a step of the field of view")
    tx.stop()
    calibrating.join()
    wire.wait_until_reads(FIELD_OF_VIEW, USERS_DEG)
    capture.stop()
    assert wire.read(FIELD_OF_VIEW) == USERS_DEG
    assert not journal_entries(world)


def sender_node(world, port: int, camera: str = "") -> tuple[ManagedProcess, str]:
    """A capture_node that waits for an eye, not started yet, and where it does."""
    listen = f"127.0.0.1:{free_tcp_port()}"
    of_xplane = {"host": "127.0.0.1", "port": port, "listen_for_beacon": False}
    own = {"capture_node/source": "sender", "capture_node/sender": {"listen": listen}}
    for key, value in {**of_xplane, **own}.items():
        world.set_param(camera + key, value)
    words = [world.program("capture_node"), f"__ns:={world.namespace}/{camera}".rstrip("/")]
    return ManagedProcess(f"capture_{camera.rstrip('/')}", words, world.folder, env=world.env), listen


def silent_eye(listen: str) -> ContextManager[None]:
    """Connects to a capture_node, lives, and measures without an end."""
    host, port = listen.split(":")
    receiver = wait_until(lambda: connected(host, int(port)), 60.0, "a capture_node that listens")

    def live(ended: threading.Event) -> None:
        receiver.sendall(encode_hello(0, "", "127.0.0.1"))
        while not ended.wait(0.2):
            receiver.sendall(encode_status(0, "it calibrates"))
        receiver.close()

    return meanwhile(live)


def connected(host: str, port: int) -> socket.socket | None:
    with contextlib.suppress(OSError):
        return socket.create_connection((host, port))
    return None


def test_one_camera_measures_at_a_time_also_by_its_eye(world) -> None:
    emulator = world.emulator("--fps", FPS)
    node, listen = sender_node(world, emulator.port)
    other, _ = sender_node(world, emulator.port, "belly/")
    refused = "another camera measures its delay, or has set_field_of_view: 'field_of_view' belongs to"
    ended = "xplane_eye is gone meanwhile"
    asking = threading.Thread(
        target=lambda: wait_until(lambda: ended in calibrate(world).message, WAIT_S, "the eye's end")
    )
    with node, other:
        with silent_eye(listen):
            asking.start()
            wait_until(lambda: refused in calibrate(world, "belly/").message, WAIT_S, "a refusal")
            wait_until(lambda: journal_entries(world) == ["field_of_view"], WAIT_S, "the first camera's entry")
        asking.join()
        wait_until(lambda: "no xplane_eye" in calibrate(world, "belly/").message, WAIT_S, "an answer of its own")
        assert not journal_entries(world)


def steps_of_another(wire) -> ContextManager[None]:
    """X-Plane's field of view meanwhile steps as an eye measures at its start, with nothing in the journal."""

    def step(ended: threading.Event) -> None:
        while not ended.wait(0.25):
            wire.send(protocol.DrefWrite(FIELD_OF_VIEW, USERS_DEG + 8.0))
            ended.wait(0.25)
            wire.send(protocol.DrefWrite(FIELD_OF_VIEW, USERS_DEG))

    return meanwhile(step)


def test_a_step_of_an_eyes_own_measurement_is_not_taken_for_the_users(world) -> None:
    emulator = world.emulator("--fps", FPS)
    wire = world.wire(emulator.port)
    node, listen = sender_node(world, emulator.port)
    with node, silent_eye(listen):
        with steps_of_another(wire):
            wait_until(lambda: "does not stand still" in calibrate(world).message, WAIT_S, "a refusal")
            assert not journal_entries(world)
        wire.wait_until_reads(FIELD_OF_VIEW, USERS_DEG)
        asking = threading.Thread(target=calibrate, args=(world,))
        asking.start()
        wait_until(lambda: journal_entries(world) == ["field_of_view"], WAIT_S, "its turn")
    asking.join()
    assert wire.read(FIELD_OF_VIEW) == USERS_DEG


@pytest.mark.parametrize(
    ("region", "own"), [((0, 0, 320, 240), False), ((0, 0, 320, 240), True), ((0, 0, 640, 480), False)]
)
def test_a_region_that_is_part_of_the_window_is_flagged(world, display: str, region: tuple, own: bool) -> None:
    """X-Plane's window has 640 x 480 px; half of it has the same shape."""
    from xplane_bridge.msg import FrameState

    world.emulator("--window", "--fps", FPS)
    window = {"display": display, "region": list(region), "change_detection": "none"}
    node = world.start("capture_node", {"window": window, "own_field_of_view": own})
    states = world.watch("camera/frame_state", FrameState)
    if region[2] < 640 and not own:
        line = "pictures of 320 x 240 px do not have the size of X-Plane's window (640 x 480 px)"
        node.wait_for_line(re.escape(line), WAIT_S)
        assert states.wait_for_next(timeout=WAIT_S).quality & FrameState.QUALITY_FOV_ASSUMED
    else:
        states.wait_for(lambda state: not state.quality & FrameState.QUALITY_FOV_ASSUMED, timeout=WAIT_S)
