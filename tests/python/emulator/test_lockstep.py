"""Lock-step on the wire: a fence ends every frame on every socket, and the next one waits for its answer."""

from __future__ import annotations

import contextlib
import socket
import threading
import time

import pytest

from support.simulator.emulator_fixture import EmulatorFixture, XPlaneClient
from xplane_bridge import protocol
from xplane_bridge.emulator.emulator import Emulator
from xplane_bridge.emulator.lockstep import Fences
from xplane_bridge.emulator.options import KINEMATIC, Options, parse

FENCE = "xplane_bridge/lockstep"
GROUP = "xplane_bridge/lockstep_group"
TIME = "sim/time/total_running_time_sec"
FENCE_INDEX = 900


class Client(XPlaneClient):
    """Asks for fences too, last, and reads what comes up to one."""

    picture = 0  #: the frame on display, by the newest fence

    def ask(self, paths, rate_hz=1000):
        self.subscribe(paths, rate_hz)
        self.subscribe([f"{FENCE}[{element}]" for element in range(4)], first_index=FENCE_INDEX)

    def leave(self):
        for element in range(4):
            self.send(protocol.RrefRequest(0, FENCE_INDEX + element, f"{FENCE}[{element}]"))

    def answer(self, frame):
        self.send(protocol.DrefWrite(FENCE, float(frame)))

    def frame(self):
        """(number, whole seconds, microseconds) of the next fence, and the pairs that came before it."""
        pairs, parts = [], 0
        while True:
            packet = self.wait()
            assert packet is not None, "no fence in 10 s"
            found = dict(protocol.decode_rref_response(packet))
            if FENCE_INDEX in found:
                if FENCE_INDEX + 3 not in found:  # frame 0 was repeated between the requests of its elements
                    pairs, parts = [], parts + 1
                    assert parts < 500, found
                    continue
                self.picture = int(found[FENCE_INDEX + 3])
                return [int(found[FENCE_INDEX + element]) for element in range(3)], pairs
            pairs += protocol.decode_rref_response(packet)

    def fences_until_quiet(self):
        """The frames whose fences come until nothing does for a while."""
        found = set()
        self.socket.settimeout(0.3)
        with contextlib.suppress(socket.timeout):
            while True:
                pairs = dict(protocol.decode_rref_response(self.socket.recv(2000)))
                found.update(int(value) for index, value in pairs.items() if index == FENCE_INDEX)
        self.socket.settimeout(10.0)
        return found

    def leave_hold(self):
        """Answers frame 0; gives the first frame that flies."""
        while self.frame()[0][0] != 0:
            pass
        self.answer(0)
        return self.first_frame()

    def first_frame(self):
        """The first frame that flies."""
        while True:
            fence, pairs = self.frame()
            if fence[0] != 0:
                return fence, pairs


@pytest.fixture(name="fly")
def fixture_fly():
    running = []

    def start(**options):
        options.setdefault("aircraft", KINEMATIC)
        options.setdefault("fps", 50.0)
        emulator = Emulator(Options(bind="127.0.0.1", port=0, beacon=False, stepped="lockstep", **options))
        thread = threading.Thread(target=emulator.run)
        thread.start()
        running.append((emulator, thread))
        return emulator

    yield start
    for emulator, thread in running:
        emulator.stopping = True
        thread.join(10.0)
        assert not thread.is_alive()


class Renderer:
    """Draws as soon as the test says so."""

    def __init__(self):
        self.frames, self.alive, self.ready = [], True, threading.Event()

    def show(self, sim):
        self.frames.append(sim.clocks.frame)

    def drawn(self, timeout_s):
        return self.ready.wait(timeout_s)


@pytest.fixture(name="bench")
def fixture_bench():
    with EmulatorFixture() as bench:
        yield bench


def test_frame_0_is_sent_again_until_it_is_answered(fly):
    client = Client(fly(sim_time_start=12.5).port)
    client.ask([TIME])
    frames = [client.frame() for _ in range(3)]
    assert [fence for fence, _ in frames] == [[0, 12, 500_000]] * 3
    assert frames[-1][1] == [(0, 12.5)]
    fence, pairs = client.leave_hold()
    assert fence == [1, 12, 520_000]
    assert pairs == [(0, pytest.approx(12.52))]


def test_every_frame_waits_for_its_own_answer(fly):
    client = Client(fly().port)
    client.ask([TIME])
    assert client.leave_hold()[0] == [1, 0, 20_000]
    client.answer(0)  # of a frame that is gone: no answer
    client.send(protocol.DrefWrite(FENCE, float("nan")))
    client.socket.settimeout(0.3)
    with pytest.raises(OSError, match="timed out"):
        client.socket.recv(2000)
    for number in range(1, 6):
        client.answer(number)
        assert client.frame()[0] == [number + 1, 0, 20_000 * (number + 1)]


def test_data_output_starts_with_the_flight_however_long_frame_0_was_held(fly):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as display:
        display.bind(("127.0.0.1", 0))
        display.setblocking(False)
        client = Client(fly(data_target=display.getsockname(), data_rows=(1,), rate=10).port)
        client.ask([TIME])
        for _ in range(25):
            client.frame()
        client.leave_hold()
        for number in range(1, 11):
            client.answer(number)
            client.frame()
        times = []
        with contextlib.suppress(BlockingIOError):
            while True:
                times.append(protocol.decode_data(display.recv(2000)).as_dict()[1][0])
    assert [time for time in times if time > 0.0] == pytest.approx([0.02, 0.12, 0.22])  # in frames 1, 6, 11


def test_fences_come_last_on_every_socket_and_slow_groups_start_with_the_flight(fly):
    port = fly().port
    fast, slow = Client(port), Client(port)
    slow.ask([TIME], rate_hz=10)
    fast.ask([TIME, "sim/time/paused"])
    while dict(fast.frame()[1]).get(1) != 0.0:
        pass
    _, pairs = slow.leave_hold()
    counts = [len(pairs)]
    fast.first_frame()
    for number in range(1, 10):
        slow.answer(number)
        fence, pairs = slow.frame()
        counts.append(len(pairs))
        assert fence[0] == number + 1
        fence, pairs = fast.frame()
        assert (fence[0], len(pairs)) == (number + 1, 2)
    assert counts == [1, 0, 0, 0, 0] * 2  # 10 a second at 50 frames a second, wherever the hold ended


def test_sockets_of_a_group_get_a_fence_with_what_else_they_get_and_the_first_says_how_many(fly):
    port = fly().port
    first, slow, fast = Client(port), Client(port), Client(port)
    group = f"{GROUP}[{first.socket.getsockname()[1]}]"
    for client in (first, slow, fast):
        client.subscribe([group], first_index=FENCE_INDEX + 8)
    slow.ask([TIME], rate_hz=10)
    fast.ask([TIME, "sim/time/paused"])
    first.ask([])
    frame_0 = {FENCE_INDEX: 0.0, FENCE_INDEX + 8: 3.0}
    # All requests have been read, and all three get something.
    said = (dict(protocol.decode_rref_response(first.wait())) for _ in range(1000))
    assert any(frame_0.items() <= each.items() for each in said)
    first.answer(0)
    while dict(protocol.decode_rref_response(fast.wait())).get(FENCE_INDEX) != 1.0:
        pass
    while first.frame()[0][0] != 1:
        pass
    while dict(protocol.decode_rref_response(slow.wait())).get(FENCE_INDEX) != 1.0:
        pass
    for number in range(2, 12):
        first.answer(number - 1)
        fence = dict(protocol.decode_rref_response(first.wait()))
        with_slow = number in (6, 11)  # 10 a second at 50 frames a second
        assert (fence[FENCE_INDEX], fence[FENCE_INDEX + 8]) == (number, 3.0 if with_slow else 2.0)
        pairs = protocol.decode_rref_response(fast.wait())
        assert [index for index, _ in pairs[:2]] == [0, 1]
        assert dict(pairs[2:]) == fence
        if with_slow:
            assert dict(protocol.decode_rref_response(slow.wait())).items() >= fence.items()
        slow.socket.settimeout(0.0)
        with pytest.raises(BlockingIOError):
            slow.socket.recv(2000)
        slow.socket.settimeout(10.0)


class HeldServer:
    """Of a frame that sends something to the second socket of a group."""

    def __init__(self, first, second):
        self._held = [(protocol.encode_rref_response([(0, 1.0)]), each) for each in (second, first)]
        self.sent = {}  #: by client, its pairs
        self.order = []  #: the clients

    def take_held(self):
        return self._held

    def send_all(self, _, datagrams):
        for packet, client in datagrams:
            self.order.append(client)
            self.sent.setdefault(client, {}).update(dict(protocol.decode_rref_response(packet)))


@pytest.mark.parametrize("requests", range(6))
@pytest.mark.parametrize("leaves", [False, True])
def test_who_joins_or_leaves_a_group_in_five_requests_is_counted_where_its_fence_is_whole(requests, leaves):
    # As bridge nodes do: the group is joined last and left first, and a frame may be flown between any two.
    first, second = ("127.0.0.1", 7001), ("127.0.0.1", 7002)
    elements = [(f"{FENCE}[{element}]", FENCE_INDEX + element) for element in range(4)]
    group = (f"{GROUP}[{first[1]}]", FENCE_INDEX + 8)
    fences = Fences()
    for path, index in [*elements, group]:
        assert fences.request(protocol.RrefRequest(1000, index, path), first)
        assert not leaves or fences.request(protocol.RrefRequest(1000, index, path), second)
    changes = [(0, group), *((0, each) for each in elements)] if leaves else [(20, each) for each in [*elements, group]]
    for rate_hz, (path, index) in changes[:requests]:
        assert fences.request(protocol.RrefRequest(rate_hz, index, path), second)
    server = HeldServer(first, second)
    fences.send(server, 0.0, 1, 0.02)
    whole = {FENCE_INDEX, FENCE_INDEX + 1, FENCE_INDEX + 2, FENCE_INDEX + 3, FENCE_INDEX + 8}
    assert whole < server.sent[first].keys()
    assert server.sent[first][FENCE_INDEX + 8] == (2.0 if whole < server.sent[second].keys() else 1.0)
    assert (FENCE_INDEX + 8 in server.sent[second]) == (server.sent[first][FENCE_INDEX + 8] == 2.0)


def test_a_frame_goes_program_by_program_and_first_to_the_one_that_answers_it():
    barrier, second = ("127.0.0.1", 7001), ("127.0.0.1", 7002)
    other, alone = ("127.0.0.1", 7003), ("127.0.0.1", 7004)
    fences = Fences()
    for client, first in ((barrier, barrier), (second, barrier), (other, other), (alone, None)):
        for element in range(4):
            fences.request(protocol.RrefRequest(1000, FENCE_INDEX + element, f"{FENCE}[{element}]"), client)
        if first is not None:
            fences.request(protocol.RrefRequest(1000, FENCE_INDEX + 8, f"{GROUP}[{first[1]}]"), client)
    before = HeldServer(barrier, second)
    fences.send(before, 0.0, 1, 0.02)
    assert before.order == [second, barrier, barrier, other, alone]
    fences.write(protocol.DrefWrite(FENCE, 0.0), other)
    after = HeldServer(barrier, second)
    fences.send(after, 0.0, 1, 0.02)
    assert after.order == [other, second, barrier, barrier, alone]
    for answering in (barrier, second):
        fences.write(protocol.DrefWrite(FENCE, 1.0), answering)
        after = HeldServer(barrier, second)
        fences.send(after, 0.0, 2, 0.04)
        assert after.order == [second, barrier, barrier, other, alone]
        assert after.sent[barrier][FENCE_INDEX + 8] == 2.0
        assert after.sent[second][FENCE_INDEX] == 2.0


def test_a_write_before_the_answer_acts_in_the_next_frame(fly):
    client = Client(fly().port)
    client.ask(["sim/cockpit2/controls/flap_ratio"])
    client.leave_hold()
    for number in range(1, 5):
        client.send(protocol.DrefWrite("sim/cockpit2/controls/flap_ratio", number / 8))
        client.answer(number)
        assert client.frame()[1] == [(0, number / 8)]


def test_a_flight_ends_after_its_duration(fly):
    emulator = fly(duration=0.1)
    client = Client(emulator.port)
    client.ask([TIME])
    assert client.leave_hold()[0][0] == 1
    for number in range(1, 6):
        client.answer(number)
    while emulator.statistics()["frames"] < 5:
        time.sleep(0.01)
    assert emulator.sim.clocks.running == pytest.approx(0.1)


def test_the_fence_says_which_frame_is_on_display(fly):
    emulator = fly(picture_every=2)
    emulator.view = renderer = Renderer()
    renderer.ready.set()
    client = Client(emulator.port)
    client.ask([TIME])
    pictures = []
    client.leave_hold()
    for number in range(1, 7):
        pictures.append(client.picture)
        client.answer(number)
        client.frame()
    assert pictures == [1, 1, 3, 3, 5, 5]
    assert renderer.frames[:3] == [1, 3, 5]


def test_the_fence_says_where_nothing_is_drawn(fly):
    client = Client(fly().port)
    client.ask([TIME])
    client.leave_hold()
    assert client.picture == 0


def test_a_frame_does_not_end_before_its_picture_is_shown(fly):
    emulator = fly()
    emulator.view = renderer = Renderer()
    client = Client(emulator.port)
    client.ask([TIME])
    while client.frame()[0][0] != 0:
        pass
    client.answer(0)
    while not renderer.frames:
        time.sleep(0.01)
    assert client.fences_until_quiet() <= {0}
    renderer.ready.set()
    assert client.first_frame()[0][0] == 1
    assert client.picture == 1


def test_a_frame_whose_window_is_gone_ends_the_emulator():
    emulator = Emulator(Options(bind="127.0.0.1", port=0, beacon=False, stepped="lockstep", aircraft=KINEMATIC))
    emulator.view = renderer = Renderer()
    renderer.ready.set()
    renderer.alive = False
    with pytest.raises(BrokenPipeError, match="the window was closed"):
        emulator.step_frames(1)
    emulator.close()


def test_another_run_begins_at_frame_0_when_all_clients_have_left(fly):
    emulator = fly(picture_every=2)
    emulator.view = renderer = Renderer()
    renderer.ready.set()
    first = Client(emulator.port)
    first.ask([TIME])
    first.leave_hold()
    for number in (1, 2):
        first.answer(number)
        first.frame()
    first.leave()
    first.answer(3)  # comes too late to be that of a frame
    second = Client(emulator.port)
    second.ask([TIME], rate_hz=10)
    fence, pairs = second.leave_hold()
    assert fence == [1, 0, 80_000]  # the flight goes on
    assert pairs == [(0, pytest.approx(0.08))]
    assert second.picture == 1
    second.answer(1)
    assert second.frame() == ([2, 0, 100_000], [])
    assert renderer.frames == [1, 3, 4]


def test_a_frame_after_whose_let_go_all_have_left_is_sent_to_no_later_client(fly):
    port = fly(pace=0.02).port  # a frame a second: they leave while it waits to fly the second one
    first, second = Client(port), Client(port)
    first.ask([TIME])
    first.leave_hold()
    first.answer(1)
    time.sleep(0.2)
    first.leave()
    second.ask([TIME])
    assert second.frame()[0][0] == 0


def test_who_leaves_while_others_stay_does_not_end_the_run(fly):
    port = fly().port
    stays, leaves = Client(port), Client(port)
    leaves.ask([TIME])
    stays.ask([TIME])
    assert stays.leave_hold()[0][0] == 1
    leaves.leave()
    stays.answer(1)
    assert stays.frame()[0][0] == 2


def test_pace_bounds_the_speed_from_above_only(fly):
    client = Client(fly(pace=2.0).port)
    client.ask([TIME])
    began = time.monotonic()  # not after it: the simulator may fly on before this process goes on
    client.leave_hold()
    for number in range(1, 21):
        client.answer(number)
        client.frame()
    assert time.monotonic() - began >= 20 * 0.02 / 2.0 - 0.001


def test_other_modes_do_not_know_the_fence(bench):
    client = bench.client()
    client.subscribe([FENCE + "[0]", TIME])
    bench.step()
    assert [index for index, _ in protocol.decode_rref_response(client.wait())] == [1]
    client.send(protocol.DrefWrite(FENCE, 3.0))
    bench.step()
    assert bench.emulator.server.ignored["dataref"] >= 2


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("--pace 2", "--pace 2.0: expected --stepped lockstep with it"),
        ("--stepped lockstep --pace -1", "--pace -1.0: expected 0..1000"),
        ("--stepped lockstep --fault drop=0.1", "expected none with --stepped lockstep"),
        ("--picture-every 2", "--picture-every 2: expected --window and --stepped lockstep with it"),
        ("--stepped lockstep --picture-every 2", "--picture-every 2: expected --window and --stepped lockstep with it"),
        ("--stepped lockstep --window --picture-every 0", "--picture-every 0: expected 1..1000"),
        (
            "--stepped lockstep --window --pipeline-delay 50ms",
            "--pipeline-delay 50ms: expected 0 with --stepped lockstep",
        ),
    ],
)
def test_options_that_make_no_sense(given, message, capsys):
    with pytest.raises(SystemExit):
        parse(given.split())
    assert message in capsys.readouterr().err
