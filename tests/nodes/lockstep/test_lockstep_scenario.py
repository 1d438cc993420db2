"""run_scenario --lockstep: the same bytes on every topic each time, however the processes are delayed."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Iterator

import numpy as np
import pytest

from support.process_tree import descendants, named
from xplane_bridge.bags import Bags
from xplane_bridge.resources import program

#: Not promised to be the same.
NOT_COMPARED = {"/diagnostics"}
#: Latched, and of several publishers, whose order is not promised.
OF_SEVERAL = {"/tf_static"}
#: In each shaken flight another of these stands still for so long [s], and then the recorder. tx_node is first: nothing
#: else shows that its guardian leaves it alone.
STALLED = ("tx_node", "rx_node", "capture_node", "joystick_mapper")
STALL_S = 12.0
RECORDER_STALL_S = 3.0  # far more than rosbag's queue of 100 messages, where the flight does not wait
FRAME_NS = 1_000_000_000 // 60
EARTH_M = 6378145.0  # X-Plane's sphere
FLIES_BYTES = 20_000  # of the truth file, which grows by some hundred a frame
RECORDER = "lockstep_record"  # as long as /proc gives names
SCENARIO = """
name: lockstep
aircraft: fixed_wing
start: {altitude: 800, speed: 65, heading: 90}
events:
  - {at: 0, hold: {roll: 0, climb: 0, speed: 65}, mode: auto}
  - {at: 0.5, mode: manual}
  - {at: 1, hold: {roll: 25}, label: turn}
  - {at: 1.5, disturb: {kind: turbulence, speed: 10, from_deg: 250, duration: 3, seed: 7, horizontal_only: true}}
  - {at: 2, excitation: {kind: doublet, target: pitch, amplitude: 0.05, duration: 1}}
  - {at: 3, failure: {name: engine_1}, label: broken}
  - {at: 4, clear_failures: true, mode: auto}
  - {after: 0.1, when: {mode: auto}, timeout: 3, label: automatic}
  - {at: 6, mode: manual, hold: {roll: 0}}
  - {after: 0.5, when: {mode: manual, stall_warning: false}, timeout: 3, label: manual}
  - {at: 8, end: true}
"""


@contextlib.contextmanager
def load() -> Iterator[None]:
    """Wants all processors."""
    burners = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(os.cpu_count() or 1)]
    try:
        yield
    finally:
        for burner in burners:
            burner.kill()
            burner.wait()


def stop_for(pid: int, time_s: float) -> None:
    """Stops a process for so long."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGSTOP)
        time.sleep(time_s)
        os.kill(pid, signal.SIGCONT)


def shake(flying: subprocess.Popen, seed: int, truth: Path, stalled: str | None) -> None:
    """Stops and continues a flight's processes at random until it ends, under load; in flight, that one for long."""
    dice = random.Random(seed)
    with load():
        while flying.poll() is None:
            pids = descendants(flying.pid)
            if stalled and truth.is_file() and truth.stat().st_size > FLIES_BYTES:
                long, stalled = stalled, None
                for name, time_s in ((long, STALL_S), (RECORDER, RECORDER_STALL_S)):
                    print(f"{name} stands still")
                    # Of those that run now: some begin late on a busy machine. tx_node's guardian is its child.
                    stop_for(min(named(descendants(flying.pid), name)), time_s)
            elif pids:
                stop_for(dice.choice(pids), dice.uniform(0.0, 0.1))
            time.sleep(dice.uniform(0.0, 0.1))


def fly(
    folder: Path, *options: str, seed: int | None = None, stalled: str | None = None, scenario: str = SCENARIO
) -> Path:
    """Flies it, shaken where there is a seed; gives the recording."""
    folder.mkdir()
    file = folder / "scenario.yaml"
    file.write_text(scenario, encoding="utf-8")
    command = [sys.executable, str(program("run_scenario")), str(file), "--lockstep", "--output", str(folder / "out")]
    with (folder / "log").open("w") as log:
        flying = subprocess.Popen([*command, *options], stdout=log, stderr=subprocess.STDOUT)
        try:
            if seed is not None:
                shake(flying, seed, folder / "out" / "truth.csv", stalled)
            flying.wait(300)
        finally:
            flying.kill()
    said = (folder / "log").read_text(encoding="utf-8")
    assert flying.returncode == 0, said
    print(said)
    return folder / "out" / "flight.bag"


def payloads(bag: Path) -> dict[str, list[bytes]]:
    """What each topic brought."""
    import rosbag

    found: dict[str, list[bytes]] = {}
    with rosbag.Bag(str(bag)) as opened:
        for topic, (_, payload, *_), _ in opened.read_messages(raw=True):
            found.setdefault(topic, []).append(payload)
    return found


def hashes(found: dict[str, list[bytes]]) -> dict[str, tuple[int, str]]:
    """Number of messages and sha256 of each topic."""
    return {
        topic: (len(kept), hashlib.sha256(b"".join(sorted(kept) if topic in OF_SEVERAL else kept)).hexdigest())
        for topic, kept in found.items()
        if topic not in NOT_COMPARED
    }


@pytest.mark.parametrize("runs", [2, pytest.param(10, marks=pytest.mark.nightly)])
def test_runs_with_joystick_mode_failure_excitation_and_pictures_are_the_same_bytes(tmp_path, runs):
    options = ["--joystick", "logitech_extreme_3d_pro", "--controller", f"{program('attitude_hold')} --roll 5"]
    options += ["--seed", "7", "--emulator=--turbulence 1 --window 320x240", "--camera", "--headless"]
    flights = []
    for number in range(runs):
        shaken = {"seed": number, "stalled": STALLED[number // 2 % len(STALLED)]} if number % 2 else {}
        bag = fly(tmp_path / str(number), *options, **shaken)
        flights.append(hashes(payloads(bag)))
        played = json.loads((bag.parent / "played.json").read_text(encoding="utf-8"))
        assert played["finished"]
        assert set(played["labels"]) == {"turn", "broken", "automatic", "manual"}
        assert played["labels"]["automatic"] == pytest.approx(4.25, abs=0.2)
    frames = flights[0]["/xplane/flight_state"][0]
    assert frames == pytest.approx(480, abs=5)
    assert flights[0]["/xplane/joy"][0] == frames
    assert flights[0]["/xplane/control/auto"][0] == frames
    for topic in ("image_raw/compressed", "camera_info", "frame_state"):
        assert flights[0][f"/xplane/camera/{topic}"][0] == (frames + 1) // 2  # the first, and every second one after it
    for flight in flights[1:]:
        differing = {
            topic: (seen, flight.get(topic)) for topic, seen in flights[0].items() if flight.get(topic) != seen
        }
        assert not differing
        assert flight.keys() == flights[0].keys()


def test_another_seed_is_another_flight(tmp_path):
    one, other = (
        hashes(payloads(fly(tmp_path / seed, "--seed", seed, "--duration", "2", "--emulator=--turbulence 1")))
        for seed in ("1", "2")
    )
    assert one["/xplane/flight_state"][0] == other["/xplane/flight_state"][0] == 120
    assert one["/xplane/flight_state"] != other["/xplane/flight_state"]


WITH_OTHERS = """
name: others
aircraft: fixed_wing
start: {altitude: 800, speed: 65, heading: 90}
events:
  - {at: 0, hold: {roll: 0, climb: 0, speed: 65}, mode: manual}
  - at: 0.5
    traffic:
      - {number: 2, ahead: 900, right: 300, turned: 180, speed: 60}
      - {number: 5, above: 50, speed: 70, climb: 2}
  - {at: 2, mode: auto, traffic: [{number: 2, ahead: 500, turned: 90, speed: 60}]}
  - {at: 3, mode: manual, traffic: []}
  - {at: 3.5, end: true}
"""


def test_other_aircraft_fly_where_the_scenario_has_them_the_same_in_every_run(tmp_path):
    one, other = (fly(tmp_path / str(seed), scenario=WITH_OTHERS, seed=seed) for seed in (None, 2))
    assert hashes(payloads(one)) == hashes(payloads(other))
    with Bags(one) as bags:
        commands, states = bags.read("/xplane/traffic/command"), bags.read("/xplane/traffic/state")
        events = [event.text for _, message in bags.messages("/xplane/events") for event in message.events]
    assert "traffic: 2, 5 placed by command" in events
    assert "traffic: 5 given back" in events
    assert "traffic: 2 given back" in events
    seen = 0
    for i, stamp in enumerate(states.stamp):
        if stamp < commands.stamp[0] + 4.5 * FRAME_NS:
            continue  # where the scenery's origin is has to be asked for first
        # They are moved from the second frame after that of the command on, by what is sent at a frame's end.
        k = int(np.searchsorted(commands.stamp, stamp - 2.5 * FRAME_NS)) - 1
        for row, number in enumerate(commands["number"][k]):
            age = (stamp - commands.stamp[k]) / 1e9 - FRAME_NS / 1e9
            north = commands["latitude"][k][row] + math.degrees(commands["velocity_north"][k][row] * age / EARTH_M)
            across = EARTH_M * math.cos(math.radians(north))
            east = commands["longitude"][k][row] + math.degrees(commands["velocity_east"][k][row] * age / across)
            at = list(states["number"][i]).index(number)
            assert (states["latitude"][i][at] - north) * EARTH_M == pytest.approx(0.0, abs=math.degrees(0.05))
            assert (states["longitude"][i][at] - east) * across == pytest.approx(0.0, abs=math.degrees(0.05))
            seen += 1
    assert seen > 30


def test_speed_is_a_limit(tmp_path):
    began = time.monotonic()
    bag = fly(tmp_path / "slow", "--speed", "1", "--duration", "4")
    assert time.monotonic() - began > 4.0
    assert len(payloads(bag)["/xplane/flight_state"]) == 240


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--lockstep", "--transport", "data"], "--transport rref"),
        (["--speed", "2"], "needs --lockstep"),
    ],
)
def test_what_cannot_be_flown_in_lockstep_is_said(tmp_path, options, message):
    done = subprocess.run(
        [sys.executable, str(program("run_scenario")), "identification", "--output", str(tmp_path / "out"), *options],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert message in done.stderr
