#!/usr/bin/env python3
"""Writes the golden packets that were never captured (numbers 20 and up) and their decoded values.

Written from docs/protocol.md with nothing but struct: neither the C++ nor the Python codec of this project is
used, so that both can be held to the result. Run it only to add a packet; the files are kept in the repository.
"""

import json
import struct
from pathlib import Path

HERE = Path(__file__).resolve().parent


def f32(value):
    """The float32 nearest to a number, as a Python float."""
    return struct.unpack("<f", struct.pack("<f", value))[0]


def text(value, width):
    """ASCII in a field of fixed width, filled with NUL."""
    raw = value.encode("ascii")
    assert len(raw) < width or width == 8
    return raw + bytes(width - len(raw))


def write(name, message, direction, body, fields, fifth=0):
    datagram = message.encode("ascii") + bytes([fifth]) + body
    (HERE / f"{name}.hex").write_text(datagram.hex() + "\n")
    document = {
        "message": message,
        "direction": direction,
        "origin": "specification",
        "bytes": len(datagram),
        "fifth_byte": fifth,
        "fields": fields,
    }
    indent = 1 if len(datagram) < 600 else None  # the long ones on one line
    (HERE / f"{name}.json").write_text(json.dumps(document, indent=indent) + "\n")


def rows_body(rows):
    return b"".join(struct.pack("<i8f", row["index"], *row["values"]) for row in rows)


def main():
    to, of = "to_xplane", "from_xplane"

    rows = [{"index": i, "values": [f32(i + slot / 8.0) for slot in range(8)]} for i in range(139)]
    write("20-data-139-rows", "DATA", of, rows_body(rows), {"rows": rows}, fifth=42)

    keep = -999.0
    rows = [
        {"index": 8, "values": [f32(-0.25), f32(0.1), f32(0.75)] + [keep] * 5},
        {"index": 25, "values": [f32(0.6), f32(0.65)] + [keep] * 6},
    ]
    write("21-data-to-xplane-rows-8-25", "DATA", to, rows_body(rows), {"rows": rows})

    path = "sim/flightmodel/engine/ENGN_thro_use[3]"
    write(
        "22-rref-request",
        "RREF",
        to,
        struct.pack("<ii", 99, 7) + text(path, 400),
        {"rate_hz": 99, "index": 7, "path": path},
    )
    pairs = [
        {"index": 3, "value": f32(-12345.678)},
        {"index": 0, "value": 0.0},
        {"index": 41, "value": f32(1e-44)},
        {"index": 2, "value": f32(36000.125)},
        {"index": -1, "value": f32(3.5)},
    ]
    write(
        "23-rref-response-5-pairs",
        "RREF",
        of,
        b"".join(struct.pack("<if", p["index"], p["value"]) for p in pairs),
        {"pairs": pairs},
        fifth=44,
    )
    pairs = [{"index": i, "value": f32(i * 0.1 - 9.0)} for i in range(183)]
    write(
        "24-rref-response-183-pairs",
        "RREF",
        of,
        b"".join(struct.pack("<if", p["index"], p["value"]) for p in pairs),
        {"pairs": pairs},
        fifth=44,
    )

    write("25-rpos-request", "RPOS", to, text("60", 10), {"rate_hz": 60})
    rpos = {
        "longitude_deg": 128.60123456789,
        "latitude_deg": 35.87654321012,
        "elevation_m": 1523.987654321,
        "height_agl_m": f32(1402.5),
        "pitch_deg": f32(3.25),
        "true_heading_deg": f32(271.1),
        "roll_deg": f32(-14.7),
        "velocity_east_mps": f32(-61.2),
        "velocity_up_mps": f32(1.75),
        "velocity_south_mps": f32(-0.4),
        "roll_rate_radps": f32(0.011),
        "pitch_rate_radps": f32(-0.022),
        "yaw_rate_radps": f32(0.033),
    }
    write("26-rpos-response", "RPOS", of, struct.pack("<3d10f", *rpos.values()), rpos, fifth=52)

    beacon = {
        "major_version": 1,
        "minor_version": 2,
        "host": 1,
        "version": 122015,
        "role": 1,
        "port": 49000,
        "computer_name": "lab-pc-3",
        "raknet_port": 49010,
    }
    fixed = struct.pack("<BBiiIH", 1, 2, 1, 122015, 1, 49000)
    write("27-becn-minor-2", "BECN", of, fixed + b"lab-pc-3\0" + struct.pack("<H", 49010), beacon)
    beacon = {
        "major_version": 1,
        "minor_version": 1,
        "host": 1,
        "version": 115501,
        "role": 1,
        "port": 49100,
        "computer_name": "SIMULATOR",
        "raknet_port": None,
    }
    fixed = struct.pack("<BBiiIH", 1, 1, 1, 115501, 1, 49100)
    write("28-becn-minor-1-padded-name", "BECN", of, fixed + text("SIMULATOR", 500), beacon)

    path = "sim/joystick/yoke_pitch_ratio"
    write("29-dref-to-xplane", "DREF", to, struct.pack("<f", 0.3) + text(path, 500), {"path": path, "value": f32(0.3)})
    path = "sim/flightmodel/position/indicated_airspeed"
    write(
        "30-dref-from-xplane",
        "DREF",
        of,
        struct.pack("<f", 101.7) + path.encode() + b"\0" + b" " * (499 - len(path)),
        {"path": path, "value": f32(101.7)},
        fifth=43,
    )

    path = "sim/operation/pause_toggle"
    write("31-cmnd", "CMND", to, path.encode() + b"\0", {"path": path})
    write("32-dsel", "DSEL", to, struct.pack("<6i", 1, 4, 16, 17, 20, 21), {"rows": [1, 4, 16, 17, 20, 21]})
    write("33-usel", "USEL", to, struct.pack("<i", 138), {"rows": [138]})
    write(
        "34-ise4",
        "ISE4",
        to,
        struct.pack("<i", 64) + text("192.168.10.107", 16) + text("49003", 8) + struct.pack("<i", 1),
        {"target": 64, "address": "192.168.10.107", "port": 49003, "enabled": True},
    )

    prel = {
        "start": 6,
        "aircraft": 0,
        "airport": "",
        "runway": 0,
        "runway_direction": 0,
        "latitude_deg": 37.4,
        "longitude_deg": 126.8,
        "elevation_m": 900.5,
        "true_heading_deg": 330.25,
        "speed_mps": 62.5,
    }
    write(
        "35-prel-lat-lon",
        "PREL",
        to,
        struct.pack("<ii", 6, 0) + bytes(8) + struct.pack("<ii5d", 0, 0, 37.4, 126.8, 900.5, 330.25, 62.5),
        prel,
    )
    prel = {
        "start": 11,
        "aircraft": 0,
        "airport": "RKSS",
        "runway": 1,
        "runway_direction": 1,
        "latitude_deg": 0.0,
        "longitude_deg": 0.0,
        "elevation_m": 0.0,
        "true_heading_deg": 0.0,
        "speed_mps": 0.0,
    }
    write(
        "36-prel-runway",
        "PREL",
        to,
        struct.pack("<ii", 11, 0) + text("RKSS", 8) + struct.pack("<ii5d", 1, 1, 0, 0, 0, 0, 0),
        prel,
    )
    path = "Aircraft/Laminar Research/Cessna 172SP/Cessna_172SP.acf"
    write(
        "37-acfn",
        "ACFN",
        to,
        struct.pack("<i", 0) + text(path, 150) + bytes(2) + struct.pack("<i", 3),
        {"aircraft": 0, "path": path, "livery": 3},
    )
    path = "Output/situations/trimmed.sit"
    write("38-simo-load", "SIMO", to, struct.pack("<i", 1) + text(path, 150) + bytes(2), {"action": 1, "path": path})

    pose = {
        "aircraft": 0,
        "latitude_deg": -33.946,
        "longitude_deg": 151.177,
        "elevation_m": 12.5,
        "true_heading_deg": f32(155.5),
        "pitch_deg": f32(-2.25),
        "roll_deg": f32(0.5),
    }
    for number, message in (("39", "VEHX"), ("40", "VEHS")):
        write(f"{number}-{message.lower()}", message, to, struct.pack("<i3d3f", *pose.values()), pose)
    write("41-rese", "RESE", to, b"", {})

    gett = {"aircraft": 0, "latitude_deg": -998.0, "longitude_deg": -998.0, "elevation_m": -998.0}
    write("42-gett-own-position", "GETT", to, struct.pack("<B3d", *gett.values()), gett)
    terr = {
        "aircraft": 0,
        "latitude_deg": 47.463627123456,
        "longitude_deg": -122.307835654321,
        "terrain_elevation_m": 121.456789,
        "normal": [f32(0.01), f32(0.9999), f32(-0.02)],
        "velocity_mps": [0.0, f32(0.5), 0.0],
        "is_wet": 1,
        "probe_result": 0,
    }
    write(
        "43-terr",
        "TERR",
        of,
        struct.pack(
            "<B3d6f2i", 0, 47.463627123456, -122.307835654321, 121.456789, *terr["normal"], *terr["velocity_mps"], 1, 0
        ),
        terr,
    )
    write("44-getp", "GETP", to, struct.pack("<B", 0), {"aircraft": 0})
    posi = {
        "gear_handle": 1,
        "latitude_deg": 47.463627123456,
        "longitude_deg": -122.307835654321,
        "elevation_m": 1500.123456789,
        "pitch_deg": f32(2.5),
        "roll_deg": f32(-30.125),
        "true_heading_deg": f32(359.9),
        "gear": 1.0,
    }
    write("45-posi", "POSI", of, struct.pack("<B3d4f", *posi.values()), posi)
    write(
        "46-rref-stop",
        "RREF",
        to,
        struct.pack("<ii", 0, 7) + text("sim/time/paused", 400),
        {"rate_hz": 0, "index": 7, "path": "sim/time/paused"},
    )


if __name__ == "__main__":
    main()
