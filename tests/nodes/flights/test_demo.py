"""The demo as a user runs it, judged from outside; and a flight whose simulator dies and comes back in the middle."""

from __future__ import annotations

import contextlib
import re
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from support.deadlines import WAIT_S
from support.process_tree import alive, descendants
from xplane_bridge import protocol, xplane_names
from xplane_bridge.bags import Bags
from xplane_bridge.emulator.view.renderer import StripError, read_strip
from xplane_bridge.harness import ManagedProcess, flight_check, wait_until
from xplane_bridge.harness.ros import ros_environment
from xplane_bridge.resources import program
from xplane_bridge.topics import TOPICS

CONNECTED, STALE, LOST = 1, 3, 4
DEMO_TIMEOUT_S = 240.0


def demo(folder: Path, *options: str) -> ManagedProcess:
    return ManagedProcess("demo", [program("demo"), "--output", folder / "out", "--headless", *options], folder)


OLDEST, NEWEST = xplane_names.VERSIONS[0], xplane_names.VERSIONS[-1]
#: Until the left aileron has been stuck and repaired; until the stick has taken over and the wing has stalled. Of the
#: simulator's time, which passes slowly on a busy machine.
LONG, SHORT = 47, 16
#: The demo's own frame rate, and one for half the processor time: most of it goes into frames and their pictures.
FULL, HALF = 60, 30
HALF_FRAME_S = 0.5 / FULL
#: Transport, seconds, X-Plane's version, frames a second: oldest and newest; those between, all by rows, and the long
#: one at the demo's own rate in full tests.
DEMOS = [
    ("rref", LONG, NEWEST, HALF),
    ("rref", SHORT, OLDEST, FULL),
    ("data", SHORT, NEWEST, HALF),
    pytest.param("rref", LONG, NEWEST, FULL, marks=pytest.mark.nightly),
    *(pytest.param("rref", SHORT, version, FULL, marks=pytest.mark.nightly) for version in xplane_names.VERSIONS[1:-1]),
    *(pytest.param("data", SHORT, version, FULL, marks=pytest.mark.nightly) for version in xplane_names.VERSIONS),
]


#: Topics that the demo's bag does not hold, and why.
NOT_IN_THE_DEMO = {
    "camera/image_raw": "recorded as JPEG",
    "control/surfaces": "no program of the demo commands single surfaces",
    "data_rows": "of transport data",
    "datarefs": "none are asked for",
    "traffic/command": "no program of the demo moves other aircraft",
}


@pytest.mark.parametrize(("transport", "seconds", "version", "fps"), DEMOS)
def test_the_demo_flies_records_judges_and_reports(
    tmp_path: Path, transport: str, seconds: int, version: str, fps: int
) -> None:
    rate = () if fps == FULL else ("--fps", str(fps))
    with demo(tmp_path, "--duration", str(seconds), "--version", version, *rate, f"transport:={transport}") as run:
        assert run.wait(DEMO_TIMEOUT_S) == 0, run.output()
    out = tmp_path / "out"
    verdicts = {v.name: v for v in flight_check.judge(out / "flight.bag", out / "truth.csv")}
    assert all(v.passed for v in verdicts.values()), verdicts
    assert {"topics", "validity", "numbers", "rate", "positions", "odometry"} <= set(verdicts)
    with Bags(out / "flight.bag") as bags:
        empty = {
            name for name in TOPICS if f"/xplane/{name}" not in bags.topics or not bags.topics[f"/xplane/{name}"].count
        }
        links = bags.read("/xplane/link_state")
        states = bags.read("/xplane/flight_state", ["roll_deg", "altitude_msl"])
    if (transport, seconds) == ("rref", LONG):
        assert empty == set(NOT_IN_THE_DEMO)
    assert links["transport"][-1] == transport
    assert xplane_names.version_of(int(links["xplane_version"][-1])) == version
    assert np.ptp(states["roll_deg"]) > 20, "the demo's flight is lively"
    output = run.output()
    assert "all well" in output
    assert re.search(r"^ok +stick +\d+ messages of the joystick", output, re.MULTILINE)
    assert re.search(r"^ok +modes .* engaged by the joystick; back by moving the stick;", output, re.MULTILINE)
    assert re.search(r"^ok +released .* all overrides are off; on during the flight: override_joystick", output, re.M)
    broken = r"ok +failure +aileron1_wing2_left 0\.0\d deg off 5 deg" if seconds > 40 else "skipped +failure +stuck"
    assert re.search(broken, output)
    report = (out / "report.html").read_text()
    for key in ("attitude", "surfaces", "engines", "images"):
        section = report[report.index(f'<section id="{key}">') :].split("</section>")[0]
        assert "Not shown" not in section, key


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A demo's bag, for tests that read it."""
    folder = tmp_path_factory.mktemp("recording")
    with demo(folder, "--duration", "6", "--fps", str(HALF)) as run:
        assert run.wait(DEMO_TIMEOUT_S) == 0, run.output()
    return folder / "out" / "flight.bag"


def export(bag: Path, form: str, out: Path, *options: str) -> Path:
    command = [sys.executable, str(program("bag_export")), str(bag), "--format", form, "-o", str(out), *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return out


@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_tables_of_the_demo_read_back_with_pandas(recording: Path, tmp_path: Path, form: str) -> None:
    file = export(recording, form, tmp_path / form) / f"flight.{form}"
    frame = pd.read_csv(file, float_precision="round_trip") if form == "csv" else pd.read_parquet(file)
    with Bags(recording) as bags:
        states = bags.read("/xplane/flight_state", ["header.stamp", "roll_deg", "altitude_msl", "sim_time"])
    assert frame["stamp_ns"].tolist() == states.stamp.tolist()
    np.testing.assert_array_equal(frame["roll_deg"], states["roll_deg"])
    np.testing.assert_array_equal(frame["altitude_msl_m"], states["altitude_msl"])
    norms = sum(frame[f"orientation_{axis}"] ** 2 for axis in "xyzw")
    np.testing.assert_allclose(norms, 1.0, atol=1e-9)


def test_trajectories_of_the_demo_are_what_evo_reads(recording: Path, tmp_path: Path) -> None:
    file_interface = pytest.importorskip("evo.tools.file_interface", reason="evo needs Python 3.10")
    tum = file_interface.read_tum_trajectory_file(str(export(recording, "tum", tmp_path / "tum") / "flight.tum"))
    file = export(recording, "euroc", tmp_path / "euroc") / "flight.euroc.csv"
    euroc = file_interface.read_euroc_csv_trajectory(str(file))
    with Bags(recording) as bags:
        odom = bags.read("/xplane/odom", ["header.stamp", *(f"pose.pose.position.{axis}" for axis in "xyz")])
    positions = np.stack([odom[f"pose.pose.position.{axis}"] for axis in "xyz"], axis=1)
    times = odom.stamp * 1e-9
    for trajectory in (tum, euroc):
        assert trajectory.check()[0]
        # A recorder subscribes to one topic after the other: the one may begin before the other.
        first, last = max(times[0], trajectory.timestamps[0]), min(times[-1], trajectory.timestamps[-1])
        both = (times > first - HALF_FRAME_S) & (times < last + HALF_FRAME_S)
        trajectory.reduce_to_time_range(first - HALF_FRAME_S, last + HALF_FRAME_S)
        assert abs(len(trajectory.timestamps) - both.sum()) <= 3  # a recorder's queue may lose some
        length = trajectory.path_length
        flown = float(np.linalg.norm(np.diff(positions[both], axis=0), axis=1).sum())
        assert length == pytest.approx(flown, rel=0.02)
        assert length > 200.0, "70 m/s for some seconds"


def test_pictures_of_the_demo_are_exported_with_their_frame_states(recording: Path, tmp_path: Path) -> None:
    # Those that are paired badly, too: how many of them a flight has depends on how busy the machine is.
    out = export(recording, "images", tmp_path / "images", "--keep-bad-frames")
    labels = pd.read_csv(out / "flight" / "labels.csv", float_precision="round_trip")
    with Bags(recording) as bags:
        frames = bags.read("/xplane/camera/frame_state", ["header.stamp", "state.roll_deg", "quality"])
        images = bags.read("/xplane/camera/image_raw/compressed", ["header.stamp"])
    rows = np.flatnonzero(np.isin(frames.stamp, images.stamp))
    assert len(rows) > 1
    assert labels["stamp_ns"].tolist() == frames.stamp[rows].tolist()
    assert set(labels["split"]) == {"train", "validation"}
    np.testing.assert_array_equal(frames["state.roll_deg"][rows], labels["state_roll_deg"])


#: Seconds of the demo in lock-step, and its pictures: of the first frame and of each second one after it.
PICTURED_S, PICTURES = 4, 120


@pytest.fixture(scope="module")
def pictured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bag of the demo's scenario in lock-step: no picture is dropped, and each is of its own frame."""
    out = tmp_path_factory.mktemp("pictured") / "out"
    command = [sys.executable, str(program("run_scenario")), "demo_flight", "--output", str(out)]
    command += ["--joystick", "logitech_extreme_3d_pro", "--controller", str(program("attitude_hold"))]
    command += ["--lockstep", "--camera", "--headless", "--duration", str(PICTURED_S)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=DEMO_TIMEOUT_S)
    assert done.returncode == 0, done.stdout + done.stderr
    return out / "flight.bag"


def test_images_of_the_demo_read_back_with_opencv_and_carry_their_states(pictured: Path, tmp_path: Path) -> None:
    out = export(pictured, "images", tmp_path / "images")
    labels = pd.read_csv(out / "flight" / "labels.csv", float_precision="round_trip")
    assert len(labels) == PICTURES
    assert set(labels["split"]) == {"train", "validation"}
    errors = []
    for file, sim_time in zip(labels["file"], labels["state_sim_time_s"]):
        image = cv2.imread(str(out / "flight" / file))
        assert image.shape == (480, 640, 3)
        with contextlib.suppress(StripError):
            errors.append(np.float32(read_strip(image).sim_time) - np.float32(sim_time))
    assert len(errors) > 0.9 * len(labels), "the strip survives JPEG and the way through the bag"
    assert not np.any(errors), "each is of its own frame"
    with Bags(pictured) as bags:
        frames = bags.read("/xplane/camera/frame_state", ["header.stamp", "state.sim_time", "state.roll_deg"])
    assert labels["stamp_ns"].tolist() == frames.stamp.tolist()
    np.testing.assert_array_equal(frames["state.roll_deg"], labels["state_roll_deg"])
    assert np.ptp(labels["state_roll_deg"]) > 20


def test_an_override_that_is_left_on_fails_the_demo(tmp_path: Path) -> None:
    # Another client takes the stick again and again: also after the bridge has given it back.
    taking = protocol.DrefWrite("sim/operation/override/override_joystick_roll", 1.0).encode()
    with demo(tmp_path, "--duration", "5", "--fps", str(HALF)) as run, socket.socket(
        socket.AF_INET, socket.SOCK_DGRAM
    ) as client:
        port = int(run.wait_for_line(r"X-Plane's port: (\d+)", DEMO_TIMEOUT_S).group(1))
        deadline = time.monotonic() + DEMO_TIMEOUT_S
        while run.running and time.monotonic() < deadline:
            client.sendto(taking, ("127.0.0.1", port))
            time.sleep(0.02)
        assert run.returncode == 1, run.output()
    assert re.search(r"^FAILED +released .* still on: override_joystick_roll$", run.output(), re.MULTILINE)
    assert "demo: failed: released" in run.output()
    assert re.search(r"^skipped +modes +", run.output(), re.MULTILINE), "5 s are too short for that, and say so"


def test_ctrl_c_ends_the_demo_and_all_it_has_started(tmp_path: Path) -> None:
    with demo(tmp_path, "--duration", "60", "--fps", str(HALF)) as run:
        run.wait_for_line(r"demo: +[1-9]\d*/60 s", DEMO_TIMEOUT_S)
        children = descendants(run.pid)
        assert len(children) >= 4, "emulator, master, roslaunch and nodes"
        run.send_signal(signal.SIGINT)
        assert run.wait(60.0) == 130, run.output()
        wait_until(lambda: not [pid for pid in children if alive(pid)], WAIT_S, "end of all children")


#: Flies in a process of its own: rospy knows one master a process, and the tests' process has its own already.
DEATH_AND_RETURN = """
import sys
import time
from pathlib import Path
from xplane_bridge.harness.flight import FlightPlan, fly
from xplane_bridge.resources import config_file

died, returned = [], []

def shake(flight):
    if not died and flight.elapsed > 4.0:
        flight.emulator.kill()
        died.append(time.monotonic())
    elif died and not returned and time.monotonic() > died[0] + 2.0:
        flight.emulator.start()
        returned.append(time.monotonic())

options = ["--fps", "60", "--pilot", str(config_file("scenarios", "demo.yaml"))]
args = {"capture": False, "tx": False}
fly(FlightPlan(Path(sys.argv[1]), 12.0, emulator_options=options, silence_allowed=60.0, launch_args=args), shake)
assert returned
"""


def test_the_bridge_survives_the_death_and_return_of_its_simulator(tmp_path: Path) -> None:
    out = tmp_path / "out"
    flight = ManagedProcess("flight", [sys.executable, "-c", DEATH_AND_RETURN, out], tmp_path, env=ros_environment())
    with flight:
        assert flight.wait(DEMO_TIMEOUT_S) == 0, flight.output()
    with Bags(out / "flight.bag") as bags:
        links = bags.read("/xplane/link_state")
        states = bags.read("/xplane/flight_state", ["header.stamp", "epoch", "valid"])
        valid_all = bags.constants("/xplane/flight_state")["VALID_ALL"]
    seen = [int(state) for state in links["state"]]
    first_loss = next(k for k, state in enumerate(seen) if state in (STALE, LOST))
    assert CONNECTED in seen[:first_loss]
    assert seen[-1] == CONNECTED or CONNECTED in seen[first_loss:], seen
    assert links["link_epoch"][-1] > links["link_epoch"][first_loss - 1], "a restarted X-Plane is a new link epoch"
    silent = np.diff(states.stamp).argmax()
    assert len(states) - silent > 60, "states flow again after the return"
    assert states["epoch"][-1] > states["epoch"][silent], "histories must not cross the restart"
    assert int(states["valid"][-1]) & valid_all == valid_all
