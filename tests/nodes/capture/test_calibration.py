"""capture_node measures the delay of the display on request, never in a recording; X-Plane's view is given back."""

from __future__ import annotations

import re
import threading
from pathlib import Path
from typing import Iterator

import pytest

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import journal_entries
from xplane_bridge import protocol
from xplane_bridge.harness import ManagedProcess, wait_until
from xplane_bridge.harness.display import VirtualDisplay

FIELD_OF_VIEW = "sim/graphics/view/field_of_view_deg"
USERS_DEG = 72.0
FPS = 20
#: More than two frames: blind timing would be wrong by these.
PIPELINE_DELAY_S = 0.12
ATTEMPTS = 6  # on a busy machine pictures come late, and then it says that it has found nothing


@pytest.fixture
def display(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    with VirtualDisplay(tmp_path) as server:
        monkeypatch.setenv("DISPLAY", server.display)
        yield server.display


def start(world, display: str, *options: str):
    """Emulator with the user's own field of view, and capture_node watched so that it takes pictures."""
    from xplane_bridge.msg import FrameState

    emulator = world.emulator("--window", "--fps", FPS, "--pipeline-delay", f"{PIPELINE_DELAY_S}s", *options)
    world.wire(emulator.port).send(protocol.DrefWrite(FIELD_OF_VIEW, USERS_DEG))
    node = world.start("capture_node", {"window": {"display": display, "search_period": 0.05}})
    states = world.watch("camera/frame_state", FrameState)
    states.wait_for(lambda state: abs(state.field_of_view_deg - USERS_DEG) < 1e-3, timeout=60.0)
    return emulator, node, states


def calibrate(world):
    from std_srvs.srv import Trigger

    return world.call("capture_node/calibrate_display_delay", Trigger)


def test_the_delay_is_measured_and_used(world, display: str) -> None:
    from xplane_bridge.msg import FrameState

    emulator, node, states = start(world, display, "--start", "air")
    assert states.last.quality & FrameState.QUALITY_DELAY_ASSUMED
    answers = []
    for _ in range(ATTEMPTS):
        answers.append(calibrate(world))
        if answers[-1].success:
            break
    assert answers[-1].success, [answer.message for answer in answers]
    delay = float(re.match(r"([0-9.]+) s, from \d+ steps", answers[-1].message).group(1))
    assert delay == pytest.approx(PIPELINE_DELAY_S, abs=0.025)
    state = states.wait_for_next(lambda s: not s.quality & FrameState.QUALITY_DELAY_ASSUMED, timeout=WAIT_S)
    assert state.display_delay == pytest.approx(delay, abs=1e-4)
    world.wire(emulator.port).wait_until_reads(FIELD_OF_VIEW, USERS_DEG)
    assert not journal_entries(world)
    status = world.values_of(world.wait_for_diagnostics("pairing"))
    assert float(status["Display delay applied (ms)"]) == pytest.approx(1e3 * delay, abs=0.1)
    status = world.values_of(world.wait_for_diagnostics("capture"))
    assert float(status["Reading a picture, longest (ms)"]) >= float(status["Reading a picture, median (ms)"]) > 0.0
    node.check_running()


@pytest.mark.parametrize(
    ("camera", "name"), [("", ""), ("belly/", ""), ("", "rosbag_record"), ("", "bag"), ("", "my_Recorder")]
)
def test_not_in_a_recording_of_this_or_another_camera(world, display: str, camera: str, name: str) -> None:
    emulator, _, _ = start(world, display)
    bag = ["rosbag", "record", "-O", world.folder / "pictures.bag", f"{world.namespace}/{camera}camera/frame_state"]
    bag += [f"__name:={name}"] if name else []
    with ManagedProcess("rosbag", [str(word) for word in bag], world.folder, env=world.env):
        wait_until(
            lambda: "records the pictures" in calibrate(world).message, 90.0, "a refusal for the recorder's sake"
        )
    assert world.wire(emulator.port).read(FIELD_OF_VIEW) == USERS_DEG


def test_a_window_with_a_view_of_its_own_is_refused_in_words(world) -> None:
    world.point_to(9)  # nothing answers there
    world.start("capture_node", {"own_field_of_view": True})
    answer = calibrate(world)
    assert not answer.success
    assert "own_field_of_view" in answer.message


def asked(world) -> threading.Thread:
    """Asks for it while the node is to end."""

    def ask() -> None:
        with pytest.raises(Exception):  # noqa: B017,PT011
            assert calibrate(world).success

    asking = threading.Thread(target=ask)
    asking.start()
    return asking


@pytest.mark.parametrize("ending", ["stop", "kill"])
def test_the_field_of_view_is_given_back_by_the_end_or_by_the_next_start(world, display: str, ending: str) -> None:
    emulator, node, _ = start(world, display)
    wire = world.wire(emulator.port)

    asking = asked(world)
    wait_until(lambda: journal_entries(world), 60.0, "the journal's entry")
    wire.wait_until_reads(FIELD_OF_VIEW, USERS_DEG + 8.0)
    if ending == "kill":
        node.kill()
        assert journal_entries(world)
        wire.send(protocol.DrefWrite(FIELD_OF_VIEW, USERS_DEG + 8.0))
        wire.wait_until_reads(FIELD_OF_VIEW, USERS_DEG + 8.0)
        world.start("capture_node", {"window": {"display": display}})
    else:
        node.stop()
    wire.wait_until_reads(FIELD_OF_VIEW, USERS_DEG)
    wait_until(lambda: not journal_entries(world), WAIT_S, "an empty journal")
    asking.join(30.0)


def test_what_a_killed_node_has_left_is_not_taken_for_the_users_own(world, display: str) -> None:
    _, node, _ = start(world, display)
    asking = asked(world)
    wait_until(lambda: journal_entries(world), 60.0, "the journal's entry")
    node.kill()
    (journal,) = (world.folder / "ros_home" / "xplane_bridge").glob("*[0-9].json")
    # X-Plane never shows it, so that it stays to be given back.
    journal.write_text(journal.read_text(encoding="utf-8").replace(FIELD_OF_VIEW, "sim/no/such"), encoding="utf-8")
    world.start("capture_node", {"window": {"display": display}})
    wait_until(lambda: "X-Plane does not say" not in calibrate(world).message, 60.0, "X-Plane heard")
    answer = calibrate(world)
    assert not answer.success
    assert "killed node has left changed is not given back yet" in answer.message
    assert journal_entries(world)
    asking.join(30.0)


def test_it_is_refused_where_changes_of_the_window_are_not_seen(world, display: str) -> None:
    world.emulator("--window", "--fps", FPS)
    world.start("capture_node", {"window": {"display": display, "change_detection": "none"}})
    answer = calibrate(world)
    assert not answer.success
    assert "with window/change_detection none it is not known when the window changes" in answer.message
