"""The emulator's side of the wire: RREF, RPOS, X-Plane Connect, DREF and CMND."""

from __future__ import annotations

import math
import struct

import pytest

from support.simulator.emulator_fixture import XPlaneClient
from support.simulator.emulator_wire import (
    LATITUDE,
    LONGITUDE,
    PAUSED,
    POSITION,
    THETA,
    TIME,
    fixture_bench,  # noqa: F401
)
from xplane_bridge import protocol

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


def test_rates_keep_their_average_where_frames_are_slower_than_asked_for(bench):
    emulator = bench(fps=60.0)
    client, mover, display = emulator.client(), emulator.client(), emulator.client()
    client.subscribe([TIME], rate_hz=20)
    mover.send(protocol.RposRequest(20))
    display.send(protocol.NetworkTarget(protocol.DATA_OUTPUT_TARGET, *display.socket.getsockname(), enabled=True))
    display.send(protocol.RowSelection("DSEL", (1,)))
    for frame in range(250):
        emulator.emulator.run_frame(0.04, frame * 0.04)  # 25 a second
    assert [len(each.received()) for each in (client, mover, display)] == [pytest.approx(200, abs=1)] * 3


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


def test_xplane_connect_gives_gear_and_its_handle(bench):
    emulator = bench(aircraft="fixed_wing", xplane_connect_port=0)
    client = XPlaneClient(emulator.emulator.describe()["xpc_port"])
    seen = []
    for handle in (0.0, 1.0, 1.0):
        emulator.write({"sim/cockpit2/controls/gear_handle_down": handle})
        emulator.step(60)
        client.send(b"GETP\0\0")
        emulator.step()
        (position,) = client.received()
        seen.append((position[5], *struct.unpack_from("<f", position, 42)))
    # six seconds from up to down
    assert seen == [(0, 0.0), (1, pytest.approx(61 / 360)), (1, pytest.approx(122 / 360))]
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
