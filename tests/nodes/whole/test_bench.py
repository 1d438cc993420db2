"""The benchmarks of the nodes run and measure something. What they measure is not judged here: machines are busy."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Dict, List

import pytest

_RUN = Path(__file__).parents[2] / "bench" / "run.py"


def measured(tmp_path: Path, names: List[str]) -> Dict[str, float]:
    """What these benchmarks gave, by `benchmark: measure`."""
    result = tmp_path / "result.json"
    done = subprocess.run(
        [sys.executable, str(_RUN), "--seconds", "1", "--json", str(result), *names],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        check=False,
        timeout=1500,
    )
    assert result.is_file(), done.stdout.decode()
    report = json.loads(result.read_text(encoding="utf-8"))
    assert report["failed"] == [], done.stdout.decode()
    assert sorted(report["results"]) == sorted(names)
    return {f"{name}: {m['name']}": m["value"] for name in names for m in report["results"][name]}


def test_benchmarks_of_the_nodes_measure(tmp_path: Path) -> None:
    """Each gives figures that can be: everything that was sent arrives, nothing takes no time."""
    measures = measured(tmp_path, ["flight_state", "control", "link_return", "capture"])
    assert measures["flight_state: datagram to callback, p50"] > 1.0
    assert measures["flight_state: datagram to bare publish to callback, p50"] > 1.0
    assert measures["control: joy to datagram, p50"] > 1.0
    # The median of all phases together is never above that of the worst.
    assert measures["control: eighths of the period that were measured"] == 8.0
    for way, worst in (("joy to datagram", "joy to datagram"), ("two bare hops and sendto", "two bare hops")):
        assert measures[f"control: {way}, p50"] <= measures[f"control: {worst}, p50 of the worst phase"]
    assert measures["link_return: states flow again, median"] < 10.0
    for grabber in ("capture_node", "ffmpeg", "mss", "GetImage"):
        assert measures[f"capture: 640x480 {grabber}: distinct pictures"] > 1.0
        assert measures[f"capture: 640x480 {grabber}: age at the subscriber, p50"] > 0.0


def test_the_benchmark_of_the_wire_log_measures(tmp_path: Path) -> None:
    """Taking a record costs something, and far less than a datagram's own way."""
    measures = measured(tmp_path, ["wire_log"])
    assert 0.0 < measures["wire_log: a datagram, median of batches"] < 1000.0
    assert measures["wire_log: records left out"] >= 0.0


def test_the_benchmark_of_the_environments_measures(tmp_path: Path) -> None:
    """An environment flies the model and more."""
    measures = measured(tmp_path, ["gym"])
    assert measures["gym: env's step of 2 frames / the model's"] > 0.8
    assert measures["gym: 8 envs in 2 processes / one env"] > 0.01
    assert measures["gym: pictures of 84x84"] > 1.0


def test_the_benchmark_of_the_eye_measures(tmp_path: Path) -> None:
    """Pictures come, take time to make, and are older at the receiver than when sent."""
    measures = measured(tmp_path, ["eye"])
    for size in ("640x480 at 30/s", "640x480 at 60/s", "1280x720 at 30/s", "1920x1080 at 20/s"):
        assert measures[f"eye: {size}: pictures"] > 0.5
        assert measures[f"eye: {size}: CPU a picture"] > 0.1
        sent, came = (measures[f"eye: {size}: change to {where}, p50"] for where in ("sent", "receiver"))
        assert 0.0 < sent < came


def test_the_benchmark_of_lockstep_measures(tmp_path: Path) -> None:
    """Flights come about, and their frames take time."""
    measures = measured(tmp_path, ["lockstep"])
    assert measures["lockstep: rx, tx, mapper, rospy controller, player, record"] > 0.01
    assert measures["lockstep: the nodes' part of a frame, mean"] > 10.0
    assert measures["lockstep: three bare roscpp nodes, mean"] > 10.0


def test_benchmarks_of_wire_and_files_measure(tmp_path: Path) -> None:
    names = ["decode", "packet_rate", "emulator_period", "command_to_surface", "steps", "campaign", "bags"]
    measures = measured(tmp_path, names)
    assert measures["bags: messages read / written"] == 1.0
    assert {name.split(":")[0] for name in measures} == set(names)
    assert all(math.isfinite(value) for value in measures.values())


@pytest.mark.nightly
@pytest.mark.parametrize(
    "name",
    [
        "bag_memory",
        "capture_1080p",
        "failsafes",
        "labels",
        "latency",
        "pairing",
        "pairing_sender",
        "pairing_windows",
        "pairing_delays",
    ],
)
def test_the_long_benchmarks_measure(tmp_path: Path, name: str) -> None:
    assert all(math.isfinite(value) for value in measured(tmp_path, [name]).values())


def test_every_benchmark_is_run_by_a_test() -> None:
    listing = subprocess.run([sys.executable, str(_RUN), "--list"], stdout=subprocess.PIPE, check=True, timeout=100)
    text = Path(__file__).read_text(encoding="utf-8")
    for line in listing.stdout.decode().splitlines():
        assert f'"{line.split()[0]}"' in text, f"no test runs {line}"
