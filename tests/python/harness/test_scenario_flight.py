"""What a scenario's start and aerodrome become on the emulator's command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from xplane_bridge.emulator.options import parse
from xplane_bridge.harness.scenario_flight import scenario_plan
from xplane_bridge.labels.apt import read_airport
from xplane_bridge.resources import config_file
from xplane_bridge.scenario import load_scenario


def test_the_approach_begins_before_the_aerodrome_that_is_shipped(tmp_path: Path) -> None:
    scenario = load_scenario(config_file("scenarios", "approach.yaml"))
    plan = scenario_plan(scenario, "approach", tmp_path, 10.0)
    options = parse(plan.emulator_options)
    assert options.aerodrome is not None
    (runway,) = read_airport([config_file("aerodromes", "apt.dat")], "XEMU").runways
    first, second = runway.ends
    assert options.aerodrome[0] == pytest.approx(0.5 * (first.latitude + second.latitude), abs=1e-8)
    assert options.aerodrome[1] == pytest.approx(0.5 * (first.longitude + second.longitude), abs=1e-8)
    assert first.number == f"{round(options.aerodrome[2] / 10.0):02d}"
    # Five decimals are a metre: the start keeps them.
    assert options.initial.latitude_deg == pytest.approx(37.487961, abs=1e-7)
    assert options.initial.longitude_deg == pytest.approx(126.422105, abs=1e-7)
