"""The benchmarks of the nodes run and measure something. What they measure is not judged here: machines are busy."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

_RUN = Path(__file__).parents[1] / "bench" / "run.py"


def test_benchmarks_of_the_nodes_measure(tmp_path: Path) -> None:
    """Each gives figures that can be: everything that was sent arrives, nothing takes no time."""
    result = tmp_path / "result.json"
    names = ["flight_state", "control", "link_return", "capture"]
    done = subprocess.run(
        [sys.executable, str(_RUN), "--seconds", "1", "--json", str(result), *names],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        check=False,
        timeout=300,
    )
    assert result.is_file(), done.stdout.decode()
    report = json.loads(result.read_text(encoding="utf-8"))
    assert report["failed"] == [], done.stdout.decode()
    assert sorted(report["results"]) == sorted(names)
    measures = {f"{name}: {m['name']}": m["value"] for name in names for m in report["results"][name]}
    assert measures["flight_state: datagram to callback, p50"] > 1.0
    assert measures["flight_state: bare roscpp publish, p50"] > 1.0
    assert measures["control: joy to datagram, p50"] > 1.0
    assert measures["link_return: states flow again, median"] < 10.0
    for grabber in ("capture_node", "ffmpeg", "mss", "GetImage"):
        assert measures[f"capture: 640x480 {grabber}: distinct pictures"] > 1.0
        assert measures[f"capture: 640x480 {grabber}: age at the subscriber, p50"] > 0.0
