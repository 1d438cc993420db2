#!/usr/bin/env python3
"""Writes xp11.json and xp12.json: a stretch of flight as the emulator sends it, with the truth beside it.

The emulator's codec, earth and axes are written from docs/protocol.md apart from the C++ core, so these files
hold the core's decoding and computing to a second opinion. They change only when this program is run:

    field_table_doc --requests > REQUESTS
    PYTHONPATH=src python3 tests/data/states/generate.py REQUESTS
"""

import dataclasses
import json
import math
import struct
import sys
from pathlib import Path

import numpy as np

from xplane_bridge import xplane_names
from xplane_bridge.emulator.aircraft.kinematic.kinematic import KinematicModel
from xplane_bridge.emulator.datarefs.aircraft_systems import Weather
from xplane_bridge.emulator.datarefs.data_rows import DataRows
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.emulator.simulator import Simulator

FOLDER = Path(__file__).resolve().parent
FRAME = 1.0 / 60.0
FRAMES = 12
#: 40 km from its scenery origin (37.5 N, 127 E), so that the origin's axes are tilted.
START = InitialState(latitude_deg=37.63, longitude_deg=126.55, heading_deg=250.0, altitude_m=1500.0)
WIND_FROM_DEG, WIND_MPS = 240.0, 9.0


def values(store, paths):
    """Float32 of every dataref element (doubles too: RREF carries nothing wider), None where it does not exist."""
    return [None if store.slot(path) is None else float(np.float32(store.values[store.slot(path)])) for path in paths]


def rpos(position):
    return struct.pack("<4sB3d10f", b"RPOS", 0x34, *dataclasses.astuple(position)).hex()


def truth(sim):
    state = dataclasses.asdict(sim.model.state)
    state["agl_m"] = (
        sim.frame.height
    )  # X-Plane's y_agl: of an aircraft on its wheels it is not the height of its centre
    return {key: value for key, value in state.items() if isinstance(value, (int, float)) and math.isfinite(value)}


def generate(version, paths):
    newest = xplane_names.NEWEST[str(version)]
    sim = Simulator(lambda _: KinematicModel(7), "fixed_wing", version=newest, initial=START, sim_time_start=5000.0)
    rows = DataRows(sim.store, sim.is_12)
    sim.settings.set_weather(Weather(WIND_FROM_DEG, WIND_MPS))
    sim.store.write("sim/operation/override/override_joystick", 1.0)
    for path, value in (("yoke_roll_ratio", 0.4), ("yoke_pitch_ratio", 0.25), ("yoke_heading_ratio", 0.2)):
        sim.store.write("sim/joystick/" + path, value)
    for _ in range(120):
        sim.step(FRAME)
    frames = []
    for _ in range(FRAMES):
        sim.step(FRAME)
        frames.append(
            {
                "rref": values(sim.store, paths),
                "data": rows.packet(np.arange(139)).hex(),
                "rpos": rpos(sim.position()),
                "truth": truth(sim),
            }
        )
    return {"version": sim.internal_version, "paths": paths, "frames": frames}


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: generate.py REQUESTS; lines of REQUESTS: '11 path' or '12 path'")
    requests = [line.split() for line in Path(sys.argv[1]).read_text(encoding="utf-8").splitlines()]
    for version in (11, 12):
        paths = sorted({path for number, path in requests if int(number) == version})
        text = json.dumps(generate(version, paths), separators=(",", ":")) + "\n"
        (FOLDER / f"xp{version}.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
