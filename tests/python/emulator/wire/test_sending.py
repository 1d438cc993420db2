"""All datagrams of a frame are sent in one call where the compiled module is there, else one by one: the same ones."""

from __future__ import annotations

import socket

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge import compiled
from xplane_bridge.emulator.wire import server

needs_core = pytest.mark.skipif(not hasattr(compiled.core, "send_datagrams"), reason="not built, or not on Linux")


@pytest.fixture(name="sockets")
def fixture_sockets():
    pair = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]
    for one in pair:
        one.bind(("127.0.0.1", 0))
        one.settimeout(10.0)
    yield pair
    for one in pair:
        one.close()


@needs_core
def test_datagrams_leave_in_their_order(sockets):
    sender, receiver = sockets
    target = receiver.getsockname()
    sent = [bytes([i]) * (i + 1) for i in range(100)]
    assert compiled.core.send_datagrams(sender.fileno(), [(packet, target) for packet in sent]) == 0
    assert [receiver.recv(1000) for _ in sent] == sent


@needs_core
def test_what_the_kernel_refuses_is_counted_and_the_rest_sent(sockets):
    sender, receiver = sockets
    target = receiver.getsockname()
    datagrams = [(b"first", target), (bytes(70000), target), (b"last", target), (bytes(70000), target)]
    assert compiled.core.send_datagrams(sender.fileno(), datagrams) == 2
    assert [receiver.recv(1000), receiver.recv(1000)] == [b"first", b"last"]


@needs_core
@pytest.mark.parametrize(
    ("datagrams", "error", "words"),
    [
        ([(b"x", ("localhost", 1))], ValueError, "'localhost': expected an IPv4 address in numbers"),
        ([("text", ("127.0.0.1", 1))], TypeError, "bytes"),
        ([(b"x", None)], TypeError, "tuple"),
    ],
)
def test_what_is_no_datagram_is_refused(sockets, datagrams, error, words):
    with pytest.raises(error, match=words):
        compiled.core.send_datagrams(sockets[0].fileno(), datagrams)


def test_a_client_gets_the_same_with_and_without_the_compiled_module(monkeypatch):
    got = []
    for core in (compiled.core, None):
        monkeypatch.setattr(server.compiled, "core", core)
        emulator = EmulatorFixture(seed=3, request_limit=1000)
        client = emulator.client()
        client.subscribe([f"sim/aircraft/view/acf_descrip[{i}]" for i in range(190)], rate_hz=20)
        client.subscribe(["sim/time/total_running_time_sec"], rate_hz=99, first_index=900)
        emulator.step(12)
        got.append(client.received())
        emulator.close()
    assert got[0] == got[1]
    assert len(got[0]) > 12
