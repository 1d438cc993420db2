"""The Python codec against the golden packets, against bytes worked out by hand, and against malformed input."""

from __future__ import annotations

import json
import random
import struct
from pathlib import Path

import pytest

from xplane_bridge import protocol

PACKETS = Path(__file__).resolve().parents[2] / "data" / "packets"
#: Messages of the X-Plane Connect plugin, which this codec does not speak.
PLUGIN = {"GETT", "TERR", "GETP", "POSI"}


def f32(value):
    """The nearest float32 of a number."""
    return struct.unpack("<f", struct.pack("<f", value))[0]


def golden(direction):
    packets = []
    for path in sorted(PACKETS.glob("*.json")):
        described = json.loads(path.read_text())
        if described["direction"] == direction and described["message"] not in PLUGIN:
            packets.append(pytest.param(described, bytes.fromhex(path.with_suffix(".hex").read_text()), id=path.stem))
    assert packets
    return packets


def rows_of(fields):
    return tuple((row["index"], tuple(map(f32, row["values"]))) for row in fields["rows"])


#: What the fields of a golden packet mean as a request.
REQUESTS = {
    "RREF": lambda d: protocol.RrefRequest(d["rate_hz"], d["index"], d["path"]),
    "RPOS": lambda d: protocol.RposRequest(d["rate_hz"]),
    "DREF": lambda d: protocol.DrefWrite(d["path"], f32(d["value"])),
    "DATA": lambda d: protocol.DataPacket(rows_of(d)),
    "CMND": lambda d: protocol.CommandRequest(d["path"]),
    "DSEL": lambda d: protocol.RowSelection("DSEL", tuple(d["rows"])),
    "USEL": lambda d: protocol.RowSelection("USEL", tuple(d["rows"])),
    "ISE4": lambda d: protocol.NetworkTarget(d["target"], d["address"], d["port"], d["enabled"]),
    "PREL": lambda d: protocol.Placement(
        d["start"],
        d["aircraft"],
        d["airport"],
        d["runway"],
        d["runway_direction"],
        d["latitude_deg"],
        d["longitude_deg"],
        d["elevation_m"],
        d["true_heading_deg"],
        d["speed_mps"],
    ),
    "ACFN": lambda d: protocol.AircraftLoad(d["aircraft"], d["path"], d["livery"]),
    "SIMO": lambda d: protocol.Situation(d["action"], d["path"]),
    "RESE": lambda _: protocol.RecoverAll(),
}
for _label in ("VEHX", "VEHS"):
    REQUESTS[_label] = lambda d, label=_label: protocol.VehiclePose(
        label,
        d["aircraft"],
        d["latitude_deg"],
        d["longitude_deg"],
        d["elevation_m"],
        f32(d["true_heading_deg"]),
        f32(d["pitch_deg"]),
        f32(d["roll_deg"]),
    )


@pytest.mark.parametrize(("described", "packet"), golden("to_xplane"))
def test_requests_decode_to_the_golden_fields(described, packet):
    assert len(packet) == described["bytes"]
    assert protocol.decode_request(packet) == REQUESTS[described["message"]](described["fields"])


@pytest.mark.parametrize(("described", "packet"), golden("to_xplane"))
def test_requests_encode_to_the_golden_bytes(described, packet):
    encoded = REQUESTS[described["message"]](described["fields"]).encode()
    if described["message"] == "RPOS":  # the golden one is padded; X-Plane takes both
        assert packet.startswith(encoded)
    elif described["message"] == "CMND":
        assert encoded.rstrip(b"\0") == packet.rstrip(b"\0")
    elif described["message"] == "DREF":
        end = packet.index(b"\0", 9) + 1  # the padding behind the NUL is free
        assert encoded[:end] == packet[:end]
        assert len(encoded) == len(packet)
    else:
        assert encoded == packet


@pytest.mark.parametrize(("described", "packet"), golden("from_xplane"))
def test_responses_decode_and_encode(described, packet):
    fields, message = described["fields"], described["message"]
    assert len(packet) == described["bytes"]
    assert packet[4] == described["fifth_byte"]
    if message == "DATA":
        decoded = protocol.decode_data(packet)
        assert decoded.rows == rows_of(fields)
        assert decoded.encode(described["fifth_byte"]) == packet
    elif message == "RREF":
        pairs = protocol.decode_rref_response(packet)
        assert pairs == [(pair["index"], f32(pair["value"])) for pair in fields["pairs"]]
        assert protocol.encode_rref_response(pairs) == packet
    elif message == "RPOS":
        position = protocol.decode_rpos_response(packet)
        names = {"heading_deg": "true_heading_deg", "vx_mps": "velocity_east_mps", "vy_mps": "velocity_up_mps"}
        names.update({"vz_mps": "velocity_south_mps", "p_radps": "roll_rate_radps", "q_radps": "pitch_rate_radps"})
        names["r_radps"] = "yaw_rate_radps"
        for name in vars(position):
            expected = fields[names.get(name, name)]
            in_double = name in ("longitude_deg", "latitude_deg", "elevation_m")
            assert getattr(position, name) == (expected if in_double else f32(expected)), name
        assert position.encode() == packet
    elif message == "DREF":
        assert protocol.decode_dref_response(packet) == protocol.DrefWrite(fields["path"], f32(fields["value"]))
    else:
        assert message == "BECN"
        beacon = protocol.decode_beacon(packet)
        assert (beacon.major, beacon.minor) == (fields["major_version"], fields["minor_version"])
        assert (beacon.host_id, beacon.version, beacon.role) == (fields["host"], fields["version"], fields["role"])
        assert (beacon.port, beacon.host_name) == (fields["port"], fields["computer_name"])
        assert beacon.raknet_port == (fields["raknet_port"] or 0)
        if beacon.minor >= 2:
            assert beacon.encode() == packet


def test_fifth_byte_of_a_request_is_not_looked_at():
    for fifth in (0x00, 0x30, 0xFF):
        packet = bytearray(protocol.RrefRequest(5, 1, "a/b").encode())
        packet[4] = fifth
        assert protocol.decode_request(bytes(packet)) == protocol.RrefRequest(5, 1, "a/b")


def test_rref_request_by_hand():
    packet = bytes.fromhex("52524546 00 14000000 03000000".replace(" ", "")) + b"sim/time/paused" + bytes(385)
    assert len(packet) == 413
    assert protocol.RrefRequest(20, 3, "sim/time/paused").encode() == packet


def test_dref_is_padded_with_spaces_behind_its_nul():
    packet = protocol.DrefWrite("a/b", 1.0).encode()
    assert packet == b"DREF\0\x00\x00\x80\x3fa/b\0" + b" " * 496


def test_data_keeps_a_row_that_comes_twice_and_takes_any_order():
    rows = ((20, (1.0,) * 8), (3, (2.0,) * 8), (20, (3.0,) * 8))
    packet = protocol.decode_data(protocol.DataPacket(rows).encode())
    assert packet.rows == rows
    assert packet.as_dict() == {20: (3.0,) * 8, 3: (2.0,) * 8}


@pytest.mark.parametrize(
    ("packet", "reason"),
    [
        (b"", "too_short"),
        (b"DATA", "too_short"),
        (b"XXXX\0", "unknown_label"),
        (b"FAIL\0" + b"3", "unknown_label"),
        (b"DATA\0", "wrong_size"),
        (b"DATA\0" + bytes(37), "wrong_size"),
        (b"RREF\0" + bytes(407), "wrong_size"),
        (b"RREF\0" + bytes(409), "wrong_size"),
        (b"DREF\0" + bytes(100), "wrong_size"),
        (b"DSEL\0", "wrong_size"),
        (b"DSEL\0" + bytes(6), "wrong_size"),
        (b"VEHX\0" + bytes(41), "wrong_size"),
        (b"RESE\0\0", "wrong_size"),
        (b"RPOS\0fast\0", "bad_value"),
        (b"RPOS\0", "bad_value"),
        (b"CMND\0\0", "bad_value"),
        (b"RREF\0" + bytes(8) + b"\xff\xfe" + bytes(398), "bad_text"),
        (b"ISE4\0" + bytes(4) + b"1.2.3.4".ljust(16, b"\0") + b"port\0\0\0\0" + bytes(4), "bad_value"),
        (b"ISE4\0" + bytes(4) + b"1.2.3.4".ljust(16, b"\0") + b"65536\0\0\0" + bytes(4), "bad_value"),
    ],
)
def test_malformed_requests_give_a_reason(packet, reason):
    with pytest.raises(protocol.DecodeError) as error:
        protocol.decode_request(packet)
    assert error.value.reason == reason
    assert str(error.value)


@pytest.mark.parametrize(
    ("decode", "packet"),
    [
        (protocol.decode_rref_response, b"RREF,"),
        (protocol.decode_rref_response, b"RREF," + bytes(9)),
        (protocol.decode_rref_response, b"DATA*" + bytes(8)),
        (protocol.decode_rpos_response, b"RPOS4" + bytes(63)),
        (protocol.decode_beacon, b"BECN\0" + bytes(10)),
        (protocol.decode_beacon, b"BECN\0\x02\x02" + bytes(14) + b"name\0"),
        (protocol.decode_beacon, b"BECN\0\x01\x02" + bytes(14) + b"no end"),
        (protocol.decode_data, b"RREF," + bytes(36)),
        (protocol.decode_dref_response, b"DREF+" + bytes(10)),
    ],
)
def test_malformed_responses_are_refused(decode, packet):
    with pytest.raises(protocol.DecodeError):
        decode(packet)


def test_no_bytes_make_a_decoder_raise_anything_else():
    chance = random.Random(11)
    labels = [path.read_text()[:8] for path in PACKETS.glob("*.hex")]
    seeds = [bytes.fromhex(path.read_text()) for path in sorted(PACKETS.glob("*.hex"))]
    decoders = (
        protocol.decode_request,
        protocol.decode_data,
        protocol.decode_rref_response,
        protocol.decode_rpos_response,
        protocol.decode_beacon,
        protocol.decode_dref_response,
    )
    refused = 0
    for _ in range(4000):
        packet = bytearray(chance.choice(seeds))
        for _ in range(chance.randrange(1, 6)):
            if packet:
                packet[chance.randrange(len(packet))] = chance.getrandbits(8)
        packet = packet[: chance.randrange(len(packet) + 1)] if chance.random() < 0.5 else packet
        if chance.random() < 0.3:
            packet[:4] = bytes.fromhex(chance.choice(labels))
        for decode in decoders:
            try:
                decode(bytes(packet))
            except protocol.DecodeError:
                refused += 1
    assert refused > 4000


def test_what_does_not_fit_is_refused_when_encoding():
    with pytest.raises(ValueError, match="at most 399"):
        protocol.RrefRequest(1, 1, "x" * 400).encode()
    with pytest.raises(ValueError, match="at most 183"):
        protocol.encode_rref_response([(0, 0.0)] * 184)
    with pytest.raises(ValueError, match="at most 499"):
        protocol.DrefWrite("x" * 500, 0.0).encode()
