"""run_campaign --refly I --through-nodes: a flight of a campaign is the same through emulator and bridge."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from support.room_table import ROOT
from xplane_bridge.bags import Bags
from xplane_bridge.bags.passport import read_passports
from xplane_bridge.resources import program

CAMPAIGN = {
    "name": "short",
    "controller": "support.flights.steady_controller:Steady",
    "arguments": {"bank": "$bank"},
    "flights": 2,
    "parameters": {"bank": {"uniform": [5, 12]}, "wind": {"uniform": [3, 9]}, "altitude": {"uniform": [900, 1100]}},
    "weather": {"wind_speed": "$wind", "wind_from": 200, "turbulence": 1.0, "temperature_offset": 10},
    "loading": {"payload": 60},
    "scenario": {
        "name": "short",
        "description": "$bank deg of bank at $altitude m",
        "aircraft": "fixed_wing",
        "start": {"altitude": "$altitude", "speed": 70, "heading": 90},
        "criteria": {
            "banks": {"measure": "maximum", "of": "roll", "above": 2, "below": 15},
            "climbs": {"measure": "maximum", "of": "altitude", "above": 5000},
        },
        "events": [
            {"at": 0, "mode": "auto", "stick": {"roll": 0, "pitch": 0, "yaw": 0}},
            {"at": 1, "label": "half"},
            {"at": 3, "end": True},
        ],
    },
}


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    paths = os.pathsep.join([str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")])
    # In a process of its own: one process is one ROS node.
    return subprocess.run(
        [sys.executable, str(program("run_campaign")), *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
        env={**os.environ, "PYTHONPATH": paths},
    )


def flown(tmp_path: Path, **changes: object) -> Path:
    file, folder = tmp_path / "campaign.yaml", tmp_path / "flown"
    file.write_text(json.dumps({**CAMPAIGN, **changes}), encoding="utf-8")  # which is YAML
    done = run(file, "-o", folder, "--workers", 0)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize(
    ("frame_rate", "frames"),
    [(60, 181), (50, 152)],  # 150 of the float32 periods of 50 Hz fall short of 3 s: the end comes a frame later
)
def test_a_flight_through_the_nodes_is_the_one_in_process(tmp_path, frame_rate, frames):
    folder = flown(tmp_path, frame_rate=frame_rate)
    done = run("-o", folder, "--refly", 1, "--through-nodes")
    assert f"the same states as in process: 47 fields of {frames} frames" in done.stdout, done.stdout + done.stderr
    assert done.returncode == 0
    lines = {line.split()[0]: line.split()[1:] for line in done.stdout.splitlines() if line}
    assert [lines["banks"][i] for i in (1, 3)] == ["met", "met"]
    assert [lines["climbs"][i] for i in (1, 3)] == ["missed", "missed"]
    assert float(lines["banks"][0]) == float(lines["banks"][2])
    assert "<html" in (folder / "refly_1/report.html").read_text(encoding="utf-8")
    with Bags(folder / "refly_1/flight.bag") as bags:
        assert read_passports(bags)[-1].flight["program"] == "run_campaign"


def test_what_rx_node_works_out_is_the_same_in_process(tmp_path):
    climbs = {"controller": "support.flights.steady_controller:Climbs"}
    done = run("-o", flown(tmp_path, **climbs), "--refly", 0, "--through-nodes")
    assert "the same states as in process: 47 fields of 181 frames" in done.stdout, done.stdout + done.stderr


def test_a_controller_that_integrates_over_frames_is_the_same_through_the_nodes(tmp_path):
    holds = {"controller": "xplane_bridge.controllers.twin:Hold", "arguments": {}}
    done = run("-o", flown(tmp_path, **holds), "--refly", 0, "--through-nodes")
    assert "the same states as in process: 47 fields of 181 frames" in done.stdout, done.stdout + done.stderr


def test_a_controller_that_is_a_function_flies_the_same_through_the_nodes(tmp_path):
    function = {"controller": "support.flights.steady_controller:level", "arguments": {}}
    done = run("-o", flown(tmp_path, **function), "--refly", 0, "--through-nodes")
    assert "the same states as in process: 47 fields of 181 frames" in done.stdout, done.stdout + done.stderr


def test_a_flight_that_differs_is_exit_code_1_and_said(tmp_path):
    # Surfaces break in the flight model in process, and by tx_node driving all of them through the nodes.
    stuck = {"name": "aileron1_wing2_left", "kind": "stuck", "value": 8}
    events = [*CAMPAIGN["scenario"]["events"], {"at": 1.5, "failure": stuck}]
    scenario = {**CAMPAIGN["scenario"], "events": sorted(events, key=lambda event: event["at"])}
    done = run("-o", flown(tmp_path, scenario=scenario), "--refly", 0, "--through-nodes")
    assert done.returncode == 1
    assert re.search(r"not the same states: from frame 9\d of 181 on, ", done.stdout), done.stdout + done.stderr


def test_excitations_restarts_hand_overs_and_failures_come_in_the_same_frames_through_the_nodes(tmp_path):
    band = {"amplitude": 0.1, "duration": 1.5, "frequency": 0.7, "frequency_end": 3.0}
    events = [
        {"at": 0, "mode": "auto", "stick": {"roll": 0, "pitch": 0, "yaw": 0}},
        {"at": 0.5, "excitation": {"kind": "doublet", "target": "pitch", "amplitude": 0.1, "duration": 0.5}},
        {"at": 1, "failure": {"name": "engine_2"}},
        {"at": 1.25, "mode": "manual", "stick": {"roll": 0.8}},
        {"at": 1.4, "stick": {"roll": 0}},
        {"at": 1.5, "mode": "auto", "label": "half"},
        {"at": 1.6, "excitation": {"kind": "3-2-1-1", "target": "roll", "amplitude": 0.3, "duration": 0.35}},
        {"at": 2, "excitation": {"kind": "multisine", "target": "pitch", **band, "seed": 7}},
        {"at": 2.5, "clear_failures": True},
        {"at": 3.6, "excitation": {"kind": "chirp", "target": "roll", **band}},
        {"at": 4.2, "stick": {"roll": 0.5}},
        {"at": 5, "end": True},
    ]
    scenario = {**CAMPAIGN["scenario"], "events": events}
    folder = flown(tmp_path, scenario=scenario, controller="support.flights.steady_controller:Counting")
    done = run("-o", folder, "--refly", 0, "--through-nodes")
    assert "the same states as in process: 47 fields of 301 frames" in done.stdout, done.stdout + done.stderr


def test_levers_and_trims_that_fail_end_in_the_same_place_through_the_nodes(tmp_path):
    events = [
        {"at": 0, "stick": {"roll": 0, "pitch": 0, "yaw": 0}, "handles": {"trim_pitch": 0.02}},
        {"at": 0.5, "failure": {"name": "rel_elv_trim_run"}},
        {"at": 0.75, "failure": {"name": "rel_throt_lo"}},
        {"at": 1.1, "handles": {"trim_pitch": 0.05}},
        {"at": 1.25, "clear_failures": True},
        {"at": 1.5, "failure": {"name": "rel_fc_ail_R"}, "stick": {"roll": 0.25}},
        {"at": 1.75, "failure": {"name": "rel_ail_trim_run"}},
        {"at": 2.5, "clear_failures": True},
        {"at": 3, "end": True},
    ]
    scenario = {**CAMPAIGN["scenario"], "events": events}
    done = run("-o", flown(tmp_path, scenario=scenario), "--refly", 0, "--through-nodes")
    assert "the same states as in process: 47 fields of 181 frames" in done.stdout, done.stdout + done.stderr


def test_a_stick_that_nothing_commands_is_centred_through_the_nodes_and_in_process(tmp_path):
    start = {"altitude": "$altitude", "speed": 10, "heading": 90}
    scenario = {**CAMPAIGN["scenario"], "aircraft": "multirotor", "start": start}
    scenario["events"] = [{"at": 0, "mode": "auto"}, *CAMPAIGN["scenario"]["events"][1:]]
    half = {"controller": "support.flights.steady_controller:half_throttle", "arguments": {}, "loading": {}}
    done = run("-o", flown(tmp_path, scenario=scenario, **half), "--refly", 0, "--through-nodes")
    assert "the same states as in process: 47 fields of 181 frames" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("changes", "arguments", "message"),
    [
        ({}, ["--through-nodes"], "--through-nodes: flies one flight again; expected --refly I with it"),
        ({}, ["--refly", 2, "--through-nodes"], "--refly 2: "),
        (
            {"scenario": {**CAMPAIGN["scenario"], "start": {"speed": 200}}},
            ["--refly", 0, "--through-nodes"],
            "--through-nodes: flight 0 did not begin (",
        ),
    ],
)
def test_what_cannot_be_flown_through_the_nodes_is_said(tmp_path, changes, arguments, message):
    folder = flown(tmp_path, **changes)
    done = run("-o", folder, *arguments)
    assert done.returncode == 1
    assert message in done.stderr
    assert not (folder / "refly_0").exists()
