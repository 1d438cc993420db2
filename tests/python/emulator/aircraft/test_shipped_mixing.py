"""config/mixing: what ships is how the emulator's twin moves its surfaces."""

from __future__ import annotations

import json
import random
from pathlib import Path

import pytest

from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.resources import config_file

FRAME_S = 1.0 / 60.0
#: Names of docs/control/surfaces.md to those of the emulator's aircraft.
PLACES = {
    "aileron1_wing2_left": "wing2l_ail1",
    "aileron1_wing2_right": "wing2r_ail1",
    "elevator1_left": "hstab1_elv1",
    "elevator1_right": "hstab2_elv1",
    "rudder1_fin1": "vstab1_rud1",
    "flap1_wing1_left": "wing1l_fla1",
    "flap1_wing1_right": "wing1r_fla1",
    "spoiler1_wing1_left": "wing1l_spo1",
    "spoiler1_wing1_right": "wing1r_spo1",
}


def terms(state, controls) -> dict[str, float]:
    """The terms of docs/control/mixing_file.md."""
    values = {"bias": 1.0, "flap1": state.flap_ratio, "speedbrake": state.speed_brake_ratio}
    for axis, ratio in (("roll", state.roll_ratio), ("pitch", state.pitch_ratio), ("yaw", state.yaw_ratio)):
        values[f"{axis}+"], values[f"{axis}-"] = max(ratio, 0.0), min(ratio, 0.0)
        values[f"trim_{axis}"] = getattr(controls, f"trim_{axis}")
    return values


def shipped() -> list[Path]:
    return sorted(config_file("mixing", "DA62-Light-twin.yaml").parent.glob("*.yaml"))


def test_only_the_twin_ships() -> None:
    """The quadrotor has no surfaces; the tiltrotor's follow no law of docs/control/mixing_file.md."""
    assert [file.name for file in shipped()] == ["DA62-Light-twin.yaml"]


def test_the_twin_moves_its_surfaces_by_the_shipped_law() -> None:
    model = create_model("fixed_wing", seed=3)
    controls = model.reset(InitialState(altitude_m=1500.0))
    law = json.loads(config_file("mixing", "DA62-Light-twin.yaml").read_text(encoding="utf-8"))
    assert law["aircraft"] == f"{model.info.icao} {model.info.description}"
    assert law["level"] == {}, "nothing is unknown"
    assert sorted(PLACES[name] for name in law["surfaces"]) == sorted(spec.name for spec in model.surfaces)
    chance = random.Random(7)
    reached = {name: [0.0, 0.0] for name in law["surfaces"]}
    for _ in range(40):
        for name in ("roll", "pitch", "yaw", "trim_roll", "trim_pitch", "trim_yaw"):
            setattr(controls, name, chance.uniform(-1.0, 1.0))
        controls.flap_request, controls.speedbrake = chance.random(), chance.random()
        for _ in range(360):  # flaps take six seconds
            model.step(FRAME_S, controls)
        values = terms(model.state, controls)
        for name, surface in law["surfaces"].items():
            asked = sum(slope * values[term] for term, slope in surface["slopes_deg"].items())
            wanted = min(max(asked, surface["low_deg"]), surface["high_deg"])
            shown = model.state.surfaces_deg[PLACES[name]]
            assert shown == pytest.approx(wanted, abs=0.05), name
            low, high = reached[name]
            reached[name] = [min(low, shown), max(high, shown)]
    for name, (low, high) in reached.items():
        assert (law["surfaces"][name]["low_deg"], law["surfaces"][name]["high_deg"]) == pytest.approx(
            (low, high), abs=1.0
        ), name
