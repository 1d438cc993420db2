"""The emulator on the wire: what X-Plane answers, to which client, when, also where that is unfriendly."""

from __future__ import annotations

import math
import random
import socket
import struct

import pytest

from support.emulator_fixture import EmulatorFixture, XPlaneClient
from xplane_bridge import protocol
from xplane_bridge.emulator.emulator import Emulator
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.emulator.options import Options
from xplane_bridge.emulator.wire.server import Beacon, PortInUseError

POSITION = "sim/flightmodel/position/"
LATITUDE, LONGITUDE, THETA = POSITION + "latitude", POSITION + "longitude", POSITION + "theta"
TIME = "sim/time/total_running_time_sec"
PAUSED = "sim/time/paused"
SEOUL = InitialState(latitude_deg=37.4602, longitude_deg=126.4407, altitude_m=1000.0, heading_deg=90.0)


@pytest.fixture(name="bench")
def fixture_bench():
    benches = []

    def make(**options):
        options.setdefault("initial", SEOUL)
        benches.append(EmulatorFixture(**options))
        return benches[-1]

    yield make
    for one in benches:
        one.close()


# --- RREF ---


def test_rref_gives_all_values_of_a_frame_in_one_datagram(bench):
    emulator = bench(fps=60.0)
    client = emulator.client()
    client.subscribe([TIME, LATITUDE, THETA])
    emulator.step(3)
    packets = client.received()
    assert [packet[:5] for packet in packets] == [b"RREF,"] * 3
    assert [len(packet) for packet in packets] == [5 + 8 * 3] * 3
    times = [dict(protocol.decode_rref_response(packet))[0] for packet in packets]
    assert times == pytest.approx([1 / 60, 2 / 60, 3 / 60], rel=1e-6)


def test_rref_splits_at_183_pairs(bench):
    emulator = bench(request_limit=1000)
    client = emulator.client()
    client.subscribe([f"sim/aircraft/view/acf_descrip[{i}]" for i in range(190)])
    emulator.step()
    assert [len(packet) for packet in client.received()] == [5 + 8 * 183, 5 + 8 * 7]


def test_rref_splits_as_set(bench):
    emulator = bench(rref_split=2)
    client = emulator.client()
    client.subscribe([TIME, LATITUDE, THETA, PAUSED, LONGITUDE])
    emulator.step()
    packets = client.received()
    assert [len(packet) for packet in packets] == [21, 21, 13]
    indices = [index for packet in packets for index, _ in protocol.decode_rref_response(packet)]
    assert sorted(indices) == [0, 1, 2, 3, 4]


def test_rref_is_float32_also_for_double_datarefs(bench):
    emulator = bench()
    (value,) = emulator.read(LONGITUDE)
    exact = emulator.sim.model.state.longitude_deg
    assert value == struct.unpack("<f", struct.pack("<f", exact))[0]
    assert value != exact


def test_rref_rate_is_held_by_skipping_frames(bench):
    emulator = bench(fps=60.0)
    client = emulator.client()
    client.subscribe([TIME], rate_hz=20)
    emulator.step(60)
    frames = [round(dict(protocol.decode_rref_response(packet))[0] * 60) for packet in client.received()]
    assert frames == list(range(1, 61, 3))


def test_rref_rate_is_capped_by_the_frame_rate(bench):
    emulator = bench(fps=30.0)
    client = emulator.client()
    client.subscribe([TIME], rate_hz=99)
    emulator.step(30)
    assert len(client.received()) == 30


def test_rref_rates_that_do_not_divide_the_frame_rate_keep_their_average(bench):
    emulator = bench(fps=60.0)
    client = emulator.client()
    client.subscribe([TIME], rate_hz=25)
    emulator.step(600)
    assert len(client.received()) == pytest.approx(250, abs=1)


def test_rref_joins_rates_that_are_due_together(bench):
    emulator = bench(fps=60.0)
    client = emulator.client()
    client.subscribe([TIME], rate_hz=60)
    client.subscribe([THETA], rate_hz=20, first_index=1)
    emulator.step(4)
    assert [len(packet) for packet in client.received()] == [21, 13, 13, 21]


def test_rref_each_sender_has_its_own_set(bench):
    emulator = bench()
    first, second = emulator.client(), emulator.client()
    first.subscribe([TIME])
    second.subscribe([THETA, LATITUDE])
    emulator.step()
    assert [len(packet) for packet in first.received()] == [13]
    assert [len(packet) for packet in second.received()] == [21]
    first.send(protocol.RrefRequest(0, 0, TIME))
    emulator.step()
    assert first.received() == []
    assert len(second.received()) == 1


def test_rref_rate_zero_stops_an_index_whatever_its_path(bench):
    emulator = bench()
    client = emulator.client()
    client.subscribe([TIME, THETA])
    emulator.step()
    client.received()
    client.send(protocol.RrefRequest(0, 1, "anything"))
    emulator.step()
    assert [len(packet) for packet in client.received()] == [13]


def test_rref_same_index_with_another_path_replaces(bench):
    emulator = bench()
    client = emulator.client()
    client.subscribe([LATITUDE])
    client.subscribe([LONGITUDE])
    emulator.step()
    assert client.values() == {0: pytest.approx(126.4407, abs=1e-3)}


@pytest.mark.parametrize(("mode", "expected"), [("omit", {0}), ("zero", {0, 1, 2})])
def test_rref_unknown_datarefs(bench, mode, expected):
    emulator = bench(unknown_datarefs=mode)
    client = emulator.client()
    client.subscribe([LATITUDE, "sim/no/such_dataref", LATITUDE + "[3]"])
    emulator.step()
    values = client.values()
    assert set(values) == expected
    assert all(values[index] == 0.0 for index in expected - {0})


def test_rref_array_elements_and_bounds(bench):
    emulator = bench()
    throttle = "sim/cockpit2/engine/actuators/throttle_ratio"
    emulator.write({f"{throttle}[1]": 0.25})
    client = emulator.client()
    client.subscribe([throttle, f"{throttle}[1]", f"{throttle}[7]", f"{throttle}[8]"])
    emulator.step()
    values = client.values()
    assert set(values) == {0, 1, 2}  # X-Plane 11 has eight engines; element 8 is unknown
    assert values[1] == 0.25
    assert values[0] != 0.25


def test_rref_requests_beyond_what_a_frame_takes_are_lost(bench):
    emulator = bench(request_limit=148)
    client = emulator.client()
    client.subscribe([f"sim/aircraft/view/acf_descrip[{i}]" for i in range(200)])
    emulator.step()
    assert set(client.values()) == set(range(148))
    assert emulator.emulator.server.ignored["flood"] == 52


def test_text_datarefs_are_read_one_character_an_element(bench):
    emulator = bench()
    client = emulator.client()
    client.subscribe([f"sim/aircraft/view/acf_ICAO[{i}]" for i in range(6)])
    emulator.step()
    values = client.values()
    assert bytes(int(values[i]) for i in range(6)) == b"KINE\0\0"


# --- RPOS ---


def test_rpos_gives_doubles(bench):
    emulator = bench()
    client = emulator.client()
    client.send(protocol.RposRequest(60))
    emulator.step(2)
    packets = client.received()
    assert len(packets) == 2
    assert packets[1][:5] == b"RPOS4"
    assert len(packets[1]) == 69
    position = protocol.decode_rpos_response(packets[1])
    state = emulator.sim.model.state
    assert position.latitude_deg == state.latitude_deg
    assert position.longitude_deg == state.longitude_deg
    assert position.elevation_m == state.altitude_m
    assert position.heading_deg == pytest.approx(90.0, abs=0.01)
    assert position.pitch_deg == pytest.approx(math.degrees(state.pitch_rad), abs=1e-5)
    assert position.vx_mps == pytest.approx(70.0, abs=0.1)  # flying east


def test_xplane_connect_answers_in_doubles(bench):
    emulator = bench(xplane_connect_port=0)
    client = XPlaneClient(emulator.emulator.describe()["xpc_port"])
    client.send(b"GETP\0\0")
    client.send(struct.pack("<5sB3d", b"GETT\0", 0, -998.0, -998.0, -998.0))
    client.send(b"GETP\0")  # too short: no answer
    emulator.step()
    position, terrain = client.received()
    state = emulator.sim.model.state
    assert position[:4] == b"POSI"
    assert len(position) == 46
    assert struct.unpack_from("<3d", position, 6) == (state.latitude_deg, state.longitude_deg, state.altitude_m)
    assert struct.unpack_from("<3f", position, 30)[2] == pytest.approx(90.0, abs=0.01)
    assert terrain[:4] == b"TERR"
    assert len(terrain) == 62
    assert struct.unpack_from("<2d", terrain, 6) == (state.latitude_deg, state.longitude_deg)
    assert struct.unpack_from("<d", terrain, 22)[0] == 0.0  # the ground, not the aircraft's wheels
    client.close()


def test_rpos_stops_at_zero_and_answers_several(bench):
    emulator = bench()
    first, second = emulator.client(), emulator.client()
    for client in (first, second):
        client.send(b"RPOS\0" + b"100".ljust(10, b"\0"))  # the padded form of 15 bytes
    emulator.step()
    first.send(protocol.RposRequest(0))
    emulator.step(2)
    assert len(first.received()) == 1
    assert len(second.received()) == 3


def test_rpos_ignores_a_rate_that_is_no_number(bench):
    emulator = bench()
    client = emulator.client()
    client.send(b"RPOS\0abc\0")
    emulator.step(2)
    assert client.received() == []


# --- DREF, CMND ---


def test_dref_accepts_nul_and_space_padding_only_at_full_length(bench):
    emulator = bench()
    client = emulator.client()
    name = "sim/cockpit2/controls/elevator_trim"
    client.send(struct.pack("<4sxf500s", b"DREF", 0.25, name.encode()))
    assert emulator.read(name) == [0.25]
    client.send(protocol.DrefWrite(name, 0.5))
    assert emulator.read(name) == [0.5]
    client.send(struct.pack("<4sxf", b"DREF", 0.75) + name.encode() + b"\0")
    assert emulator.read(name) == [0.5]


def test_dref_to_a_read_only_or_unknown_dataref_is_silent(bench):
    emulator = bench()
    (before,) = emulator.read(POSITION + "lat_ref")
    emulator.write({POSITION + "lat_ref": 1.0, "sim/no/such": 2.0})
    assert emulator.read(POSITION + "lat_ref") == [before]
    assert emulator.emulator.server.ignored["dataref"] == 2


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_dref_with_a_value_that_is_no_number_changes_nothing(bench, value):
    emulator = bench()
    emulator.write({"sim/operation/override/override_joystick": 1.0, "sim/joystick/yoke_pitch_ratio": value})
    emulator.step(5)
    assert emulator.read("sim/joystick/yoke_pitch_ratio") == [0.0]
    assert math.isfinite(emulator.sim.model.state.latitude_deg)


def test_dref_to_an_int_dataref_is_cut_to_whole_numbers(bench):
    emulator = bench()
    emulator.write({"sim/cockpit2/controls/gear_handle_down": 0.9})
    assert emulator.read("sim/cockpit2/controls/gear_handle_down") == [0.0]


def test_cmnd_works_terminated_or_not_and_unknown_ones_are_silent(bench):
    emulator = bench()
    client = emulator.client()
    client.send(b"CMND\0sim/operation/pause_toggle")
    assert emulator.read(PAUSED) == [1.0]
    client.send(protocol.CommandRequest("sim/operation/pause_toggle"))
    assert emulator.read(PAUSED) == [0.0]
    client.send(protocol.CommandRequest("sim/no/such_command"))
    assert emulator.read(PAUSED) == [0.0]


def test_cmnd_gear_flaps_and_views(bench):
    emulator = bench()
    client = emulator.client()
    for command in ("flight_controls/landing_gear_up", "flight_controls/flaps_down", "view/chase"):
        client.send(protocol.CommandRequest("sim/" + command))
    values = emulator.read(
        "sim/cockpit2/controls/gear_handle_down",
        "sim/cockpit2/controls/flap_ratio",
        "sim/graphics/view/view_type",
        "sim/graphics/view/view_is_external",
    )
    assert values == [0.0, 0.25, 1017.0, 1.0]


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
