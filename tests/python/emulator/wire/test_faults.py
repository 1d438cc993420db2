"""Faults on request, and the channel that applies them."""

from __future__ import annotations

import pytest

from support.simulator.emulator_fixture import EmulatorFixture
from xplane_bridge import protocol
from xplane_bridge.emulator.emulator import Emulator
from xplane_bridge.emulator.options import KINEMATIC, Options
from xplane_bridge.emulator.wire.faults import FaultPlan, FaultSyntaxError, FaultyChannel, Outage, parse_faults
from xplane_bridge.harness.xplane_client import XPlaneClient

TIME = "sim/time/total_running_time_sec"
NO_CLIENT = ("127.0.0.1", 9)


def test_all_faults_are_read():
    plan = parse_faults("drop=0.1, delay=20ms,jitter=0.005s,dup,reorder=0.3,truncate,indrop=1,freeze=2s@10,restart=3")
    assert plan == FaultPlan(
        drop=0.1,
        incoming_drop=1.0,
        delay_s=0.02,
        jitter_s=0.005,
        duplicate=0.1,
        reorder=0.3,
        truncate=0.05,
        freeze=Outage(10.0, 2.0),
        restart=Outage(5.0, 3.0),
    )
    assert parse_faults("") == FaultPlan()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("dorp=0.1", "unknown fault 'dorp=0.1'"),
        ("drop", "expected drop=P"),
        ("drop=2", "from 0 to 1, got '2'"),
        ("drop=much", "got 'much'"),
        ("delay=20", None),
        ("delay=fast", "expected a time such as 20ms"),
        ("delay", "expected a time"),
        ("freeze=2s@soon", "got 'soon'"),
        ("delay=-1s", "expected a time"),
    ],
)
def test_what_cannot_be_read_is_said(text, expected):
    if expected is None:
        assert parse_faults(text).delay_s == 20.0  # a bare number is seconds
        return
    with pytest.raises(FaultSyntaxError, match=expected.replace("'", ".")):
        parse_faults(text)


def send(plan, count=2000, seed=1):
    """Sends numbered datagrams a millisecond apart and gives (arrival, datagram) in order of arrival."""
    channel = FaultyChannel(plan, seed)
    out = []
    for i in range(count):
        channel.put(i * 1e-3, b"%05d" % i, NO_CLIENT)
        out += [(i * 1e-3, packet) for packet, _ in channel.ready(i * 1e-3)]
    out += [(channel.next_due(), packet) for packet, _ in channel.ready(1e9)]
    return out


def test_drop_loses_its_share():
    assert len(send(FaultPlan(drop=0.25))) == pytest.approx(1500, abs=60)


def test_dup_sends_its_share_twice():
    packets = [packet for _, packet in send(FaultPlan(duplicate=0.25))]
    assert len(packets) == pytest.approx(2500, abs=60)
    assert len(set(packets)) == 2000


def test_reorder_swaps_neighbours_and_loses_nothing():
    packets = [packet for _, packet in send(FaultPlan(reorder=0.2))]
    assert len(packets) >= 1999  # one may still be held back at the end
    swapped = sum(b < a for a, b in zip(packets, packets[1:]))
    assert 200 < swapped < 500
    assert all(abs(int(packet) - i) <= 1 for i, packet in enumerate(packets))


def test_truncate_cuts():
    packets = [packet for _, packet in send(FaultPlan(truncate=0.5))]
    assert sum(len(packet) < 5 for packet in packets) == pytest.approx(1000, abs=80)


def test_delay_holds_back_by_its_time():
    arrivals = send(FaultPlan(delay_s=0.02), count=100)
    assert [packet for _, packet in arrivals] == [b"%05d" % i for i in range(100)]
    assert arrivals[10][0] == pytest.approx(0.03, abs=1.1e-3)


def test_the_same_seed_gives_the_same_faults():
    plan = FaultPlan(drop=0.3, duplicate=0.2, reorder=0.2, jitter_s=0.01)
    assert send(plan, seed=5) == send(plan, seed=5)
    assert send(plan, seed=5) != send(plan, seed=6)


def test_faults_reach_the_wire():
    with EmulatorFixture(fault=parse_faults("drop=0.5"), seed=3) as bench:
        client = bench.client()
        client.subscribe([TIME])
        bench.step(400)
        assert len(client.received()) == pytest.approx(200, abs=40)
    with EmulatorFixture(fault=parse_faults("indrop=1")) as bench:
        client = bench.client()
        client.subscribe([TIME])
        bench.step(5)
        assert client.received() == []


def test_delayed_datagrams_leave_later():
    with EmulatorFixture(fault=parse_faults("delay=100ms"), fps=60.0) as bench:
        client = bench.client()
        client.subscribe([TIME])
        bench.step(6)
        assert client.received() == []
        bench.step(2)
        assert len(client.received()) == 2


def test_freeze_stops_frames_and_keeps_subscriptions():
    with EmulatorFixture(fault=parse_faults("freeze=1s@0.5"), fps=60.0) as bench:
        client = bench.client()
        client.subscribe([TIME])
        bench.step(30)
        assert len(client.received()) == 30
        bench.step(60)
        assert client.received() == []
        bench.step(10)
        times = [dict(protocol.decode_rref_response(packet))[0] for packet in client.received()]
        assert len(times) == 10
        assert times[0] == pytest.approx(31 / 60, abs=1e-5)


def test_delayed_datagrams_do_not_bring_x_plane_back_early(monkeypatch):
    fault = parse_faults("delay=50ms,restart=0.5s@0.2")
    options = Options(
        aircraft=KINEMATIC, bind="127.0.0.1", port=0, beacon=False, duration=1.0, xplane_connect_port=0, fault=fault
    )
    emulator = Emulator(options)
    port, seen = emulator.describe()["xpc_port"], []
    leave, come_back = emulator.leave, emulator.come_back
    monkeypatch.setattr(emulator, "leave", lambda: seen.append((leave(), emulator.describe()["xpc_port"])))
    monkeypatch.setattr(emulator, "come_back", lambda: seen.append((come_back(), emulator.describe()["xpc_port"])))
    client = XPlaneClient(emulator.port)
    client.subscribe([TIME])
    emulator.run()
    client.close()
    assert seen == [(None, None), (None, port)], "it leaves once, and comes back once"


def test_restart_closes_the_port_and_forgets_clients():
    with EmulatorFixture(fault=parse_faults("restart=1s@0.5"), fps=60.0) as bench:
        client = bench.client()
        client.subscribe([TIME])
        bench.step(31)
        client.received()
        client.send(protocol.RrefRequest(100, 0, TIME))  # no server is there: lost
        bench.step(65)
        assert client.received() == []
        client.subscribe([TIME])
        bench.step(2)
        times = [dict(protocol.decode_rref_response(packet))[0] for packet in client.received()]
        assert len(times) == 2
        assert times[0] < 0.3  # a new run
