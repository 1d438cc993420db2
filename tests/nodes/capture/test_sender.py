"""capture_node with the pictures that xplane_eye sends: emulator's window, sender and node, on an Xvfb."""

from __future__ import annotations

import contextlib
import os
import random
import re
import signal
import socket
import threading
import time
from pathlib import Path
from typing import Callable, Iterator

import numpy as np
import pytest

from support.deadlines import WAIT_S
from support.nodes.late_pictures import ShownFrames, decoded, joined, punctual_frames, schedule_late, seldom
from xplane_bridge import protocol
from xplane_bridge.emulator.view.renderer import read_strip
from xplane_bridge.eye import program as eye_program
from xplane_bridge.eye.grab import TITLES
from xplane_bridge.eye.pairing import Decision
from xplane_bridge.eye.verify import Verification
from xplane_bridge.harness import EmulatorProcess, ManagedProcess, wait_until
from xplane_bridge.harness.ports import free_tcp_port
from xplane_bridge.resources import program

pytestmark = pytest.mark.usefixtures("screen")

FIELD_OF_VIEW = "sim/graphics/view/field_of_view_deg"
TIMES_ON_SCREEN = "sim/network/dataout/data_to_screen[1]"
LONGEST_S = 300.0
FPS = 20
WIDTH, HEIGHT = 320, 240  #: [px] of window and pictures, small: to be drawn, read, sent and decoded many times
USERS_DEG = 72.0
ATTEMPTS = 6  # on a busy machine pictures come late, and then it says that it has found nothing
#: Three periods of perfectly regular frames: timing alone cannot show them. Longer than any drawing takes.
PIPELINE_DELAY_S = 0.15
#: Of what the states carry of a measured delay.
CARRIED_WITHIN_S = 0.01
#: Of a delay that was measured while pictures may come late.
MEASURED_WITHIN_S = 0.025


class Relay:
    """A way to capture_node that stands still at random, as a network that loses packets does."""

    def __init__(self, to_port: int, chance: float, stall_s: float) -> None:
        self._to_port = to_port
        self._chance = chance
        self._stall_s = stall_s
        self._draw = random.Random(4)
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        self.stalls = 0
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        while True:
            try:
                eye, _ = self._server.accept()
            except OSError:
                return
            try:
                node = socket.create_connection(("127.0.0.1", self._to_port))
            except OSError:  # capture_node does not listen yet
                eye.close()
                continue
            threading.Thread(target=self._carry, args=(node, eye, 0.0), daemon=True).start()
            self._carry(eye, node, self._chance)

    def _carry(self, source: socket.socket, target: socket.socket, chance: float) -> None:
        try:
            while True:
                data = source.recv(1448)  # a packet of an Ethernet
                if not data:
                    break
                if self._draw.random() < chance:
                    self.stalls += 1
                    time.sleep(self._stall_s)
                target.sendall(data)
        except OSError:
            pass
        target.close()

    def close(self) -> None:
        self._server.close()


class Scene:
    """Emulator, rx_node, capture_node and, when asked for, the eye."""

    def __init__(self, world, folder: Path) -> None:
        from sensor_msgs.msg import CompressedImage, Image
        from xplane_bridge.msg import FrameState

        self.world = world
        self.folder = folder
        self.port = free_tcp_port()
        self.emulator = world.emulator(
            "--window",
            f"{WIDTH}x{HEIGHT}",
            "--fps",
            FPS,
            "--pipeline-delay",
            f"{PIPELINE_DELAY_S}s",
            "--swap-log",
            folder / "swaps.csv",
            "--start",
            "air",
        )
        world.start("rx_node")
        params = {"source": "sender", "sender": {"listen": f"127.0.0.1:{self.port}", "token": "window seat"}}
        self.node = world.start("capture_node", {**params, "max_rate": 0.0, "width": WIDTH, "height": HEIGHT})
        self.images = world.watch("camera/image_raw", Image)
        self.shown = ShownFrames(self.images.messages)
        self.jpegs = world.watch("camera/image_raw/compressed", CompressedImage)
        self.states = world.watch("camera/frame_state", FrameState)

    def eye(self, *options: str, port: int = 0) -> ManagedProcess:
        """Not started yet."""
        token = self.folder / "token"
        token.write_text("window seat\n", encoding="utf-8")
        where = [f"127.0.0.1:{port or self.port}", "--xplane", f"127.0.0.1:{self.emulator.port}", "--local-port", "0"]
        own = ["--undo-file", self.folder / "undo.json", "--token-file", token]
        return ManagedProcess("xplane_eye", [program("xplane_eye"), *where, *own, *options], self.folder)

    def judged(self) -> list:
        """`punctual` ones of all pictures; ends the emulator."""
        self.emulator.stop()
        return self.punctual()

    def punctual(self) -> list:
        """State and strip of each picture so far that the emulator showed when it was due."""
        shown = self.shown.by_stamp()
        punctual = punctual_frames(self.folder / "swaps.csv", PIPELINE_DELAY_S, FPS)
        states = [state for state in list(self.states.messages) if state.header.stamp in shown]
        pairs = [(state, shown[state.header.stamp]) for state in states]
        return [(state, frame) for state, frame in pairs if frame.frame in punctual]

    def wait_until_perfect(self, count: int, and_also: Callable[[], bool] = lambda: True) -> None:
        """Waits for so many: on a busy machine few pictures come when they are due."""
        enough = seldom(self.states, lambda: perfect(self.punctual()) >= count and and_also())
        wait_until(enough, 3 * WAIT_S, f"{count} perfectly paired pictures that were punctual")


@pytest.fixture
def scene(world, tmp_path: Path) -> Scene:
    return Scene(world, tmp_path)


def perfect(pairs: list) -> int:
    """How many carry no flag."""
    return sum(state.quality == 0 for state, _ in pairs)


def check_exact(pairs: list, at_least: int) -> None:
    """Each unflagged picture carries the very frame that it shows."""
    perfect = [(state, shown) for state, shown in pairs if state.quality == 0]
    wrong = [
        (shown.frame, shown.sim_time, state.frame_sim_time)
        for state, shown in perfect
        if np.float32(state.frame_sim_time) != np.float32(shown.sim_time)
        or state.state.sim_time != np.float32(shown.sim_time)
    ]
    assert wrong == []
    assert len(perfect) >= at_least


def calibrate(scene: Scene):
    """The answer once capture_node hears X-Plane: until then it refuses."""
    from std_srvs.srv import Trigger

    def heard():
        answer = scene.world.call("capture_node/calibrate_display_delay", Trigger)
        return None if "X-Plane does not say its field of view" in answer.message else answer

    return wait_until(heard, WAIT_S, "X-Plane heard by capture_node")


def measure(scene: Scene) -> str:
    """Has the delay measured, again where a busy machine has drawn too late; what is said of it."""
    answers = [calibrate(scene)]
    while not answers[-1].success and len(answers) < ATTEMPTS:
        answers.append(calibrate(scene))
    assert answers[-1].success, [answer.message for answer in answers]
    return answers[-1].message


def test_regular_frames_and_a_delay_of_three_periods_are_paired_exactly(scene: Scene) -> None:
    from xplane_bridge.msg import FrameState

    with scene.eye() as eye:
        delay = eye.wait_for_line(r"delay: (\d+\.\d ms, from|not measured)", 90.0).group(1)
        if delay == "not measured":
            delay = measure(scene)
        delay_s = float(delay.split()[0]) * 1e-3
        scene.states.wait_for(lambda state: state.quality == 0, 60.0, "a perfectly paired picture")
        scene.wait_until_perfect(30, and_also=lambda: len(joined(scene.jpegs, scene.images)) >= 5)
        jpegs, images = list(scene.jpegs.messages), {image.header.stamp: image for image in scene.images.messages}
        pairs = scene.judged()
    check_exact(pairs, 30)
    measured = [s.display_delay for s, _ in pairs if not s.quality & FrameState.QUALITY_DELAY_ASSUMED]
    assert delay_s == pytest.approx(PIPELINE_DELAY_S, abs=MEASURED_WITHIN_S)
    assert measured == pytest.approx([delay_s] * len(measured), abs=CARRIED_WITHIN_S)
    compared = 0
    for jpeg in jpegs:  # image_raw is what the sender's own JPEG decodes to
        if jpeg.header.stamp in images:
            compared += 1
            assert decoded(jpeg).tobytes() == images[jpeg.header.stamp].data
    assert compared >= 5
    image = next(iter(images.values()))
    assert (image.width, image.height, image.encoding) == (WIDTH, HEIGHT, "bgr8")


def test_a_delay_that_is_not_measured_is_flagged_on_each_picture(scene: Scene) -> None:
    from xplane_bridge.msg import FrameState

    with scene.eye("--no-calibrate"):
        scene.images.wait_for_count(40, timeout=90.0)
        pairs = scene.judged()
    assert pairs
    assert all(state.quality & FrameState.QUALITY_DELAY_ASSUMED for state, _ in pairs)
    assert all(state.frame_sim_time > shown.sim_time for state, shown in pairs), "none should be right by itself"


@pytest.mark.parametrize(("chance", "stall_s"), [(0.012, 0.2), (0.06, 0.2)], ids=["stalls", "loses packets"])
def test_a_poor_network_costs_pictures_and_mispairs_none(scene: Scene, chance: float, stall_s: float) -> None:
    relay = Relay(scene.port, chance, stall_s)
    try:
        with scene.eye("--delay", str(PIPELINE_DELAY_S), port=relay.port):
            scene.states.wait_for(lambda state: state.quality == 0, 60.0, "a perfectly paired picture")
            first, began = len(scene.images.messages), time.monotonic()
            wait_until(lambda: relay.stalls >= 20 and len(scene.images.messages) > first + 60, 90.0, "stalls")
            came, due = len(scene.images.messages) - first, FPS * (time.monotonic() - began)
            scene.wait_until_perfect(15)
            pairs = scene.judged()
    finally:
        relay.close()
    assert came < due
    check_exact(pairs, 15)


def test_an_eye_that_looks_too_late_says_so(scene: Scene) -> None:
    """Stopped for most of a frame, as on a busy computer, it sees pictures when the next one is nearer."""
    from xplane_bridge.msg import FrameState

    with scene.eye("--delay", str(PIPELINE_DELAY_S)) as eye:
        scene.states.wait_for(lambda state: state.quality == 0, 60.0, "a perfectly paired picture")
        first = len(scene.states.messages)

        def enough() -> bool:
            pairs = scene.punctual()
            late = any(state.quality == FrameState.QUALITY_BORDERLINE for state, _ in pairs)
            unflagged = sum(state.quality == 0 for state in scene.states.messages[first:])
            return unflagged >= 60 and late and perfect(pairs) >= 15

        schedule_late(eye, 1.0 / FPS, seldom(scene.states, enough), 3 * WAIT_S)
        pairs = scene.judged()
    check_exact(pairs, 15)
    assert any(state.quality == FrameState.QUALITY_BORDERLINE for state, _ in pairs)


def test_the_next_start_gives_the_field_of_view_back_after_a_kill(scene: Scene) -> None:
    wire = scene.world.wire(scene.emulator.port)
    own = wire.read(FIELD_OF_VIEW)
    while wire.read(FIELD_OF_VIEW) == own:  # killed between two steps, it may leave the user's value
        eye = scene.eye()
        eye.start()
        wait_until(lambda: wire.read(FIELD_OF_VIEW) != own, 60.0, "a step of the field of view")
        eye.kill()
    with scene.eye("--no-calibrate"):
        wire.wait_until_reads(FIELD_OF_VIEW, own)
        wait_until(lambda: not (scene.folder / "undo.json").exists(), WAIT_S, "the end of the note")


def test_the_delay_is_measured_on_request_without_a_restart_but_not_in_a_recording(scene: Scene) -> None:
    from xplane_bridge.msg import FrameState

    answer = calibrate(scene)
    assert not answer.success
    assert f"no xplane_eye on 127.0.0.1 has connected to 127.0.0.1:{scene.port}" in answer.message
    wire = scene.world.wire(scene.emulator.port)
    wire.send(protocol.DrefWrite(FIELD_OF_VIEW, USERS_DEG))
    wire.wait_until_reads(FIELD_OF_VIEW, USERS_DEG)
    topic = f"{scene.world.namespace}/camera/frame_state"
    bag = ["rosbag", "record", "-O", str(scene.folder / "pictures.bag"), topic]
    with contextlib.ExitStack() as recording:
        recording.enter_context(ManagedProcess("rosbag", bag, scene.folder, env=scene.world.env))
        wait_until(
            lambda: "records the pictures" in calibrate(scene).message, 60.0, "a refusal for the recorder's sake"
        )
        with scene.eye() as eye:
            eye.wait_for_line("delay: not measured, as capture_node's pictures are being recorded", 60.0)
            state = scene.states.wait_for(lambda _: True, 60.0, "a picture")
            assert state.quality & FrameState.QUALITY_DELAY_ASSUMED
            assert "records the pictures" in calibrate(scene).message
            assert wire.read(FIELD_OF_VIEW) == USERS_DEG
            recording.close()
            wait_until(lambda: "records the pictures" not in calibrate(scene).message, 60.0, "the recorder's end")
            first = len(scene.states.messages)
            message = measure(scene)
            assert re.match(r"\d+\.\d ms, from \d+ steps that lie", message)
            delay = float(message.split()[0]) * 1e-3
            assert delay == pytest.approx(PIPELINE_DELAY_S, abs=MEASURED_WITHIN_S)
            sure = scene.states.wait_for_next(
                lambda s: not s.quality & FrameState.QUALITY_DELAY_ASSUMED, timeout=WAIT_S
            )
            assert sure.display_delay == pytest.approx(delay, abs=CARRIED_WITHIN_S)
            wire.wait_until_reads(FIELD_OF_VIEW, USERS_DEG)
            wait_until(lambda: not (scene.folder / "undo.json").exists(), WAIT_S, "the end of the note")
            # Without pictures while it measures; a busy machine may show the same for a second at other times.
            assert not any(s.quality & FrameState.QUALITY_FROZEN for s in scene.states.messages[first:])


def test_an_eye_that_leaves_the_field_of_view_alone_refuses_in_words(scene: Scene) -> None:
    wire = scene.world.wire(scene.emulator.port)
    with scene.eye("--delay", "0.1"):
        scene.states.wait_for(lambda _: True, 60.0, "a picture")
        answer = calibrate(scene)
        assert not answer.success
        assert "--delay or --no-calibrate" in answer.message
    assert wire.read(FIELD_OF_VIEW) == pytest.approx(60.0)


@contextlib.contextmanager
def recorded(scene: Scene) -> Iterator[None]:
    """A recorder has the pictures meanwhile."""
    import rosgraph

    topic = f"{scene.world.namespace}/camera/frame_state"

    def recorders() -> list:
        _, subscribers, _ = rosgraph.Master("/test_sender").getSystemState()
        return [node for name, nodes in subscribers if name == topic for node in nodes if "/record" in node]

    bag = ["rosbag", "record", "-O", str(scene.folder / "pictures.bag"), topic]
    with ManagedProcess("rosbag", bag, scene.folder, env=scene.world.env):
        wait_until(lambda: recorders() != [], 60.0, "the recorder")
        yield


def test_nothing_is_measured_while_the_pictures_are_recorded_but_on_request(scene: Scene) -> None:
    from xplane_bridge.msg import FrameState

    wire = scene.world.wire(scene.emulator.port)
    with recorded(scene):
        with scene.eye() as eye:
            eye.wait_for_line("delay: not measured, as capture_node's pictures are being recorded", 60.0)
            assert wire.read(FIELD_OF_VIEW) == pytest.approx(60.0)
            state = scene.states.wait_for(lambda _: True, 60.0, "a picture")
        assert state.quality & FrameState.QUALITY_DELAY_ASSUMED
        with scene.eye("--calibrate-now") as eye:
            eye.wait_for_line("calibrating: X-Plane's field of view changes", 60.0)


def test_a_recording_that_begins_before_x_plane_does_is_not_measured_in(scene: Scene) -> None:
    scene.emulator.stop()
    with scene.eye() as eye:
        eye.wait_for_line("takes pictures", WAIT_S)
        eye.wait_for_line("waiting for X-Plane", WAIT_S)
        with recorded(scene):
            emulator = scene.world.emulator("--window", "--fps", FPS, port=scene.emulator.port)
            eye.wait_for_line("delay: not measured, as capture_node's pictures are being recorded", 60.0)
            scene.states.wait_for(lambda _: True, 60.0, "a picture")
            assert scene.world.wire(emulator.port).read(FIELD_OF_VIEW) == pytest.approx(60.0)
        wait_until(lambda: "records the pictures" not in calibrate(scene).message, 60.0, "the recorder's end")
        # On that request: the connection is still the first one.
        eye.wait_for_line("calibrating: X-Plane's field of view", 60.0)
        assert "gone" not in eye.output()


def test_a_wrong_token_and_a_missing_sender_are_said(scene: Scene) -> None:
    missing = scene.world.wait_for_diagnostics("capture", lambda status: status.level == 2, timeout=WAIT_S)
    assert f"no xplane_eye on 127.0.0.1 has connected to 127.0.0.1:{scene.port}" in missing.message
    eye = scene.eye("--no-calibrate")
    (scene.folder / "token").write_text("aisle seat", encoding="utf-8")
    with eye:
        eye.wait_for_line("the token is not the one in capture_node's sender/token", WAIT_S)
        scene.world.wait_for_diagnostics("capture", lambda status: "sender/token" in status.message, timeout=WAIT_S)


@pytest.mark.parametrize(
    ("sender", "text"),
    [
        ({}, 'listen ""'),
        ({"listen": "49790"}, 'listen "49790"'),
        ({"listen": "127.0.0.1:9", "peer": "pc"}, 'peer "pc"'),
    ],
)
def test_wrong_addresses_are_refused_in_words(world, sender: dict, text: str) -> None:
    node = world.start("capture_node", {"source": "sender", **({"sender": sender} if sender else {})})
    assert node.wait(WAIT_S) == 1
    assert text in node.output()


def flown_window(world) -> EmulatorProcess:
    return world.emulator("--window", "--fps", FPS, "--pipeline-delay", f"{PIPELINE_DELAY_S}s", "--start", "air")


def test_the_pairing_is_verified_by_the_time_that_x_plane_prints(world, tmp_path: Path) -> None:
    emulator = flown_window(world)
    wire = world.wire(emulator.port)
    own = ["--local-port", "0", "--undo-file", tmp_path / "undo.json", "--xplane", f"127.0.0.1:{emulator.port}"]
    with ManagedProcess("xplane_eye", [program("xplane_eye"), "--verify", *own], tmp_path) as eye:
        eye.wait_for_line("learning its digits", 90.0)
        assert wire.read(TIMES_ON_SCREEN) == 1.0
        said = eye.wait_for_line(r"(\d+) of (\d+) stills show the frame that they are paired with", 180.0)
        assert int(said.group(2)) > 100
        eye.wait(WAIT_S)
    assert wire.read(TIMES_ON_SCREEN) == 0.0
    assert wire.read(FIELD_OF_VIEW) == pytest.approx(60.0)
    assert list(tmp_path.glob("undo*")) == []


@pytest.mark.parametrize("frames", [0, 1])
def test_pictures_that_are_a_frame_off_are_found_by_the_time_that_x_plane_prints(
    world, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, frames: int
) -> None:
    emulator = flown_window(world)
    shown = {}

    class Watched(Verification):
        def offer(self, decision: Decision) -> None:
            shown[decision.frame.index] = round((read_strip(decision.picture).sim_time - decision.frame.key) * FPS)
            super().offer(decision)

    monkeypatch.setattr(eye_program, "Verification", Watched)
    eye = eye_program.Eye(
        eye_program.EyeOptions(
            receiver=None,
            xplane=("127.0.0.1", emulator.port),
            titles=TITLES,
            window=None,
            token="",
            quality=90,
            delay_s=PIPELINE_DELAY_S + frames / FPS,
            calibrate=False,
            while_recorded=False,
            local_port=0,
            undo_file=tmp_path / "undo.json",
        ),
        print,
    )
    limit = threading.Timer(LONGEST_S, os.kill, (os.getpid(), signal.SIGTERM))  # its run ends by that with Ctrl-C
    limit.start()
    try:
        eye.run()
    except KeyboardInterrupt:
        pytest.fail("no findings in time")
    finally:
        limit.cancel()
    found = eye.findings
    assert found is not None
    assert len(found.stills) > 150
    # Each as its strip says, whenever it appeared; pictures are late on a busy machine.
    assert [still.off for still in found.stills] == [shown[still.index] for still in found.stills]
    assert found.off[frames] > 20
