"""The emulator's wire while it pauses, starts and loads, with two addresses, and under requests that are none."""

from __future__ import annotations

import math
import random
import socket

import pytest

from support.simulator.emulator_wire import (
    LATITUDE,
    LONGITUDE,
    PAUSED,
    POSITION,
    SEOUL,
    TIME,
    fixture_bench,  # noqa: F401
)
from xplane_bridge import protocol
from xplane_bridge.emulator.emulator import Emulator
from xplane_bridge.emulator.flight.flight_model import FlightModelError
from xplane_bridge.emulator.options import Options
from xplane_bridge.emulator.wire.server import Beacon, PortInUseError

# --- pause ---


def test_values_keep_coming_while_paused_and_time_stands(bench):
    emulator = bench()
    client = emulator.client()
    client.subscribe([TIME, PAUSED, LONGITUDE])
    emulator.step(10)
    client.send(protocol.CommandRequest("sim/operation/pause_toggle"))
    client.received()
    emulator.step(10)
    rows = [dict(protocol.decode_rref_response(packet)) for packet in client.received()]
    assert len(rows) == 10
    assert all(row == rows[0] for row in rows)
    assert rows[0][1] == 1.0


def test_output_can_stop_while_paused(bench):
    emulator = bench(send_while_paused=False)
    client = emulator.client()
    client.subscribe([TIME])
    client.send(protocol.CommandRequest("sim/operation/pause_toggle"))
    emulator.step(5)
    assert client.received() == []


# --- start, loading, ports ---


def test_zeros_before_a_flight_is_loaded(bench):
    emulator = bench(load_time=1.0, fps=60.0)
    client = emulator.client()
    client.subscribe([LATITUDE, POSITION + "local_y", TIME, "sim/version/xplane_internal_version"])
    client.send(protocol.RposRequest(60))
    emulator.step(30)
    packets = client.received()
    values = dict(protocol.decode_rref_response([p for p in packets if p[:4] == b"RREF"][-1]))
    assert values[0] == values[1] == 0.0
    assert values[2] == pytest.approx(0.5)
    assert values[3] == 115501.0
    assert protocol.decode_rpos_response([p for p in packets if p[:4] == b"RPOS"][-1]).latitude_deg == 0.0
    emulator.step(40)
    assert client.values()[0] == pytest.approx(37.46, abs=0.01)


def test_sim_time_starts_where_set_and_steps_as_float32(bench):
    emulator = bench(sim_time_start=32768.0, fps=100.0)
    client = emulator.client()
    client.subscribe([TIME])
    emulator.step(100)
    times = [dict(protocol.decode_rref_response(packet))[0] for packet in client.received()]
    quantum = 2.0**-8  # 3.9 ms: 24 bits of mantissa from 2^15 on
    assert all((time / quantum).is_integer() for time in times)
    assert times[-1] == pytest.approx(32769.0, abs=quantum)


def test_port_in_use_is_said_with_a_remedy(bench):
    emulator = bench()
    with pytest.raises(PortInUseError, match=rf"UDP port {emulator.emulator.port} on 127.0.0.1 is in use.*--port"):
        Emulator(Options(bind="127.0.0.1", port=emulator.emulator.port, beacon=False, aircraft="kinematic"))


def test_restart_loses_subscriptions_overrides_and_time(bench):
    emulator = bench()
    client = emulator.client()
    client.subscribe([TIME])
    emulator.write({"sim/operation/override/override_joystick": 1.0})
    emulator.step(60)
    client.received()
    port = emulator.emulator.port
    emulator.emulator.leave()
    emulator.emulator.come_back()
    assert emulator.emulator.port == port
    emulator.step(5)
    assert client.received() == []
    assert emulator.read("sim/operation/override/override_joystick") == [0.0]
    assert emulator.read(TIME)[0] < 0.2


# --- what is ignored ---


def test_other_letters_and_wrong_sizes_are_ignored_silently(bench):
    emulator = bench()
    client = emulator.client()
    client.subscribe([TIME])
    for junk in (
        b"",
        b"R",
        b"RREF",
        b"PAPT\0",
        b"VEH1\0" + bytes(40),
        b"VEHX\0" + bytes(39),
        b"PREL\0" + bytes(65),
        b"DATA\0" + bytes(35),
        b"DSEL\0" + bytes(3),
        b"ISE4\0" + bytes(31),
        b"RREF\0" + bytes(407),
    ):
        client.send(junk)
    emulator.step()
    assert [len(packet) for packet in client.received()] == [13]


def test_random_bytes_never_stop_it(bench):
    emulator = bench(version="12")
    client = emulator.client()
    chance = random.Random(4)
    labels = [
        b"RREF",
        b"RPOS",
        b"DREF",
        b"DATA",
        b"CMND",
        b"DSEL",
        b"USEL",
        b"DCOC",
        b"ISE4",
        b"PREL",
        b"ACFN",
        b"ACPR",
        b"SIMO",
        b"VEHX",
        b"VEHS",
        b"RESE",
        b"XXXX",
    ]
    sizes = [5, 9, 13, 37, 41, 45, 69, 77, 161, 165, 229, 413, 509]
    for _ in range(3000):
        size = chance.choice(sizes) if chance.random() < 0.8 else chance.randrange(600)
        body = bytearray(chance.getrandbits(8) for _ in range(size))
        body[:4] = chance.choice(labels)
        emulator.emulator.server.handle(bytes(body), ("127.0.0.1", client.port))
        if chance.random() < 0.1:
            emulator.step()
    emulator.emulator.server.subscriptions.clear()
    emulator.sim.pause(False)
    emulator.sim.start_flight(SEOUL)
    assert emulator.read(LATITUDE)[0] == pytest.approx(37.46, abs=0.01)


def test_extreme_numbers_in_valid_messages_never_stop_it(bench):
    emulator = bench()
    client = emulator.client()
    for value in (0.0, -0.0, 1e-44, 1e38, -1e38, math.inf, -math.inf, math.nan, -999.0):
        for name in emulator.sim.store.names():
            emulator.emulator.server.handle(protocol.DrefWrite(name, value).encode(), ("127.0.0.1", client.port))
        rows = tuple((row, (value,) * 8) for row in range(139))
        client.send(protocol.DataPacket(rows))
        client.send(protocol.Placement(6, latitude_deg=value, longitude_deg=value, elevation_m=value, speed_mps=value))
        client.send(protocol.VehiclePose("VEHX", 0, value, value, value, value, value, value))
        emulator.step(2)
        emulator.sim.start_flight(SEOUL)
    client.subscribe([TIME])
    emulator.step()
    assert client.received()


@pytest.mark.parametrize("error", [OverflowError("too large"), ZeroDivisionError(), FlightModelError("no flight")])
def test_a_request_whose_handler_raises_is_counted(bench, monkeypatch, error):
    emulator = bench()

    def fail():
        raise error

    monkeypatch.setattr(emulator.sim, "repair_all", fail)
    client = emulator.client()
    client.send(protocol.RecoverAll())
    client.subscribe([TIME])
    emulator.step()
    assert client.received()
    assert emulator.emulator.server.ignored["value"] == 1


# --- a computer with two addresses ---


def test_answers_can_come_from_a_second_address_of_the_machine(bench):
    emulator = bench(answer_from="127.0.0.2")
    client = emulator.client()
    client.subscribe([TIME])
    emulator.step()
    packet, sender = client.socket.recvfrom(protocol.MAX_DATAGRAM)
    assert packet[:4] == b"RREF"
    assert sender == ("127.0.0.2", emulator.emulator.port)


def test_a_deaf_one_sends_what_was_selected_and_answers_nothing(bench):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(10.0)
        emulator = bench(deaf=True, data_target=listener.getsockname(), data_rows=(1, 17, 20), rate=60)
        client = emulator.client()
        client.subscribe([TIME])
        client.send(protocol.DrefWrite("sim/time/sim_speed", 4.0))
        emulator.step(3)
        packet = protocol.decode_data(listener.recv(protocol.MAX_DATAGRAM))
    assert sorted(packet.as_dict()) == [1, 17, 20]
    assert emulator.emulator.statistics()["subscriptions"] == {}
    assert emulator.sim.store.get("sim/time/sim_speed") == 1.0


def test_statistics_count_subscriptions_by_client(bench):
    emulator = bench()
    first, second = emulator.client(), emulator.client()
    first.subscribe([TIME, "sim/time/paused"])
    second.send(protocol.RposRequest(10))
    emulator.step()
    named = {f"127.0.0.1:{client.socket.getsockname()[1]}": count for client, count in ((first, 2), (second, 1))}
    assert emulator.emulator.statistics()["subscriptions"] == named


def test_a_machine_can_announce_itself_from_two_addresses():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(10.0)
        message = protocol.Beacon(115501, 49000, "one computer")
        beacon = Beacon("127.0.0.1", message, *listener.getsockname(), second_address="127.0.0.2")
        beacon.poll(0.0)
        heard = [listener.recvfrom(protocol.MAX_DATAGRAM) for _ in range(2)]
        beacon.close()
    assert [sender[0] for _, sender in heard] == ["127.0.0.1", "127.0.0.2"]
    assert [packet for packet, _ in heard] == [message.encode()] * 2


# --- loading ---


def test_nothing_is_read_or_sent_while_a_flight_loads_and_requests_wait(bench):
    emulator = bench(fps=20.0, loading_time=1.0)
    client = emulator.client()
    client.subscribe([TIME, LATITUDE])
    emulator.step(2)
    assert len(client.received()) == 2
    client.send(protocol.Placement(6, latitude_deg=10.0, longitude_deg=20.0, elevation_m=1000.0, speed_mps=50.0))
    client.send(protocol.Placement(6, latitude_deg=30.0, longitude_deg=20.0, elevation_m=1000.0, speed_mps=50.0))
    client.send(protocol.DrefWrite("sim/cockpit2/controls/flap_ratio", 0.5))
    emulator.step(20)  # the frame that reads it, and one second
    assert client.received() == []
    # the second one waited, and has the flight loaded anew
    emulator.step(1)
    assert client.received() == []
    assert emulator.sim.store.get("sim/cockpit2/controls/flap_ratio") == 0.0
    emulator.step(20)
    values = client.values()
    assert values[1] == pytest.approx(30.0)
    assert emulator.sim.store.get("sim/cockpit2/controls/flap_ratio") == 0.5
    assert emulator.read("sim/time/total_flight_time_sec")[0] < 0.5


@pytest.mark.parametrize(
    "request_",
    [protocol.AircraftLoad(0, "kinematic.acf"), protocol.CommandRequest("sim/operation/reset_flight")],
)
def test_an_aircraft_and_a_reset_take_time_to_load_too(bench, request_):
    emulator = bench(fps=20.0, loading_time=0.5, version="12")
    client = emulator.client()
    client.subscribe([TIME])
    client.send(request_)
    emulator.step(10)
    assert client.received() == []
    emulator.step(5)
    assert client.received() != []


def test_a_request_that_loads_nothing_takes_no_time(bench):
    emulator = bench(loading_time=10.0)
    client = emulator.client()
    client.subscribe([TIME])
    client.send(protocol.AircraftLoad(0, "no_such_aircraft.acf"))
    client.send(protocol.Situation(protocol.Situation.LOAD, "no_such_situation.sit"))
    emulator.step(1)
    assert len(client.received()) == 1
