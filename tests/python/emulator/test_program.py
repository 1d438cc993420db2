"""The emulator as a program: options, the lines it prints, real time, stepping, truth, beacon, signals."""

from __future__ import annotations

import csv
import json
import math
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from support.deadlines import PROGRAM_S, WAIT_S
from support.simulator.emulator_fixture import EmulatorFixture, XPlaneClient
from xplane_bridge import protocol
from xplane_bridge.emulator.options import OptionError, drop_ros_arguments, parse
from xplane_bridge.emulator.truth import COLUMNS

PROGRAM = Path(__file__).resolve().parents[3] / "scripts" / "xplane_emulator"
TIME = "sim/time/total_running_time_sec"
SO_TIMESTAMPNS = 35


class Program:
    """The emulator in a process of its own."""

    def __init__(self, *options):
        where = ["--bind", "127.0.0.1", "--port", "0", "--model", "kinematic"]
        beacon = [] if "--beacon-target" in options else ["--no-beacon"]
        self.process = subprocess.Popen(
            [sys.executable, str(PROGRAM), *where, *beacon, *map(str, options)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.ready = self.line("READY")
        self.port = self.ready["port"]

    def line(self, word):
        """The JSON of the next line, which must begin with this word."""
        deadline = threading.Timer(WAIT_S, self.process.kill)
        deadline.start()
        text = self.process.stdout.readline()
        deadline.cancel()
        if not text.startswith(word + " "):
            self.process.kill()
            pytest.fail(f"expected {word}, got {text!r}; stderr: {self.process.stderr.read()}")
        return json.loads(text[len(word) :])

    def say(self, text):
        self.process.stdin.write(text + "\n")
        self.process.stdin.flush()

    def stop(self, number=signal.SIGTERM):
        self.process.send_signal(number)
        code = self.process.wait(WAIT_S)
        return code, self.process.stderr.read()

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(WAIT_S)
        for stream in (self.process.stdin, self.process.stdout, self.process.stderr):
            stream.close()


@pytest.fixture(name="program")
def fixture_program():
    running = []

    def start(*options):
        running.append(Program(*options))
        return running[-1]

    yield start
    for one in running:
        one.close()


# --- options ---


def test_defaults():
    options = parse([])
    assert (options.port, options.version, options.fps, options.rate, options.aircraft) == (
        49000,
        "11.55",
        60.0,
        20,
        "fixed_wing",
    )
    assert options.beacon
    assert not options.initial.on_ground


@pytest.mark.parametrize(
    ("given", "version"),
    [("11", "11.55"), ("12", "12.10"), ("11.40", "11.40"), ("11.55", "11.55"), ("12.00", "12.00"), ("12.08", "12.08")],
)
def test_a_major_version_is_the_newest_of_its_lists(given, version):
    assert parse(["--version", given]).version == version


def test_data_output_from_the_start():
    options = parse(["--data-target", "192.168.1.20:49003", "--data-rows", "1, 3,16-18", "--deaf"])
    assert options.data_target == ("192.168.1.20", 49003)
    assert options.data_rows == (1, 3, 16, 17, 18)
    assert options.deaf
    assert (parse([]).data_target, parse([]).data_rows, parse([]).deaf) == (None, (), False)


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--data-target", "here:1"),
        ("--data-target", "1.2.3.4"),
        ("--data-target", "1.2.3.4:0"),
        ("--data-rows", "3-1"),
        ("--data-rows", "139"),
        ("--data-rows", "a"),
    ],
)
def test_bad_data_output_is_refused_with_an_example(option, value, capsys):
    with pytest.raises(SystemExit):
        parse([option, value])
    assert f"{option} {value}: expected" in capsys.readouterr().err


def test_sigusr1_has_it_print_its_statistics_and_fly_on(program):
    one = program()
    for _ in range(2):
        one.process.send_signal(signal.SIGUSR1)
        assert one.line("STATUS")["subscriptions"] == {}
    assert one.stop()[0] == 0


@pytest.mark.parametrize(
    "mode",
    [("--stepped", "lockstep"), ("--stepped", "fast", "--duration", 1e6), ("--stepped",)],
    ids=["lockstep", "fast", "lines"],
)
def test_it_prints_its_statistics_in_every_stepped_mode(program, mode):
    one = program(*mode)
    one.process.send_signal(signal.SIGUSR1)
    if mode == ("--stepped",):
        one.say("1")
    assert one.line("STATUS")["subscriptions"] == {}
    assert one.stop()[0] == 0


def test_options_reach_where_they_belong():
    text = (
        "--start ground --lat -23.2 --lon 313.04 --heading -90 --version 12 --fps 30 --rate 50 --seed 7 --port 0 "
        "--wind 270/8 --sim-time-start 40000 --pipeline-delay 50ms --fault drop=0.1,delay=20ms --no-beacon --stepped "
        "--model kinematic"
    )
    options = parse(text.split())
    assert options.initial.on_ground
    assert options.initial.longitude_deg == pytest.approx(-46.96)
    assert options.initial.heading_deg == 270.0
    assert (options.version, options.fps, options.rate, options.seed) == ("12.10", 30.0, 50, 7)
    assert options.wind == (270.0, 8.0)
    assert options.pipeline_delay == pytest.approx(0.05)
    assert options.fault.delay_s == pytest.approx(0.02)
    assert (options.stepped, options.aircraft, options.beacon) == ("lines", "kinematic", False)
    assert options.aerodrome is None
    assert parse(["--aerodrome=-33.9,151.2,155"]).aerodrome == (-33.9, 151.2, 155.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--fps 0", "--fps 0.0: expected 1..500"),
        ("--lat 91", "--lat 91.0: expected -90..90"),
        ("--lat nan", "--lat nan: expected a finite number"),
        ("--port 70000", "--port 70000: expected 0..65535"),
        ("--aircraft glider", "--aircraft glider: expected one of fixed_wing, multirotor, tiltrotor, kinematic"),
        ("--wind west", "--wind west: expected FROM/SPEED"),
        ("--fault dorp=1", "unknown fault 'dorp=1'"),
        ("--bind localhost", "--bind localhost: expected an IPv4 address"),
        ("--pilot nowhere.yaml", "--pilot nowhere.yaml: expected an existing file"),
        ("--stepped fast", "--stepped fast: expected --duration with it"),
        ("--rref-split 184", "--rref-split 184: expected 1..183"),
        ("--version 10", "invalid choice: '10'"),
        ("--aerodrome 47,8", "'47,8': expected latitude,longitude,heading in degrees"),
        ("--aerodrome 97,8,0", "'97,8,0': expected latitude,longitude,heading"),
        ("--seed -1", "--seed -1: expected 0 or more"),
        ("--stepped fast --duration inf", "--duration inf: expected more than 0, and finite"),
        ("--stepped --duration 5", "--duration 5.0: expected none with --stepped, whose lines say how long"),
        ("--stepped --frame-jitter 5ms", "--frame-jitter 5ms: expected 0 with --stepped"),
        ("--hud", "--hud given: expected --window with it"),
        ("--swap-log swaps.csv", "--swap-log swaps.csv: expected --window with it"),
        ("--stepped lockstep --deaf", "--deaf given: expected --stepped other than lockstep"),
        ("--stepped lockstep --loading-time 1", "--loading-time 1.0: expected 0 with --stepped lockstep"),
        ("--answer-from 192.0.2.9", "argument --answer-from: 192.0.2.9: expected an IPv4 address of this machine"),
        ("--second-beacon here", "argument --second-beacon: here: expected an IPv4 address of this machine"),
    ],
)
def test_wrong_options_are_said(arguments, message, capsys):
    with pytest.raises(SystemExit) as end:
        parse(arguments.split())
    assert end.value.code == 2
    assert message in capsys.readouterr().err
    assert issubclass(OptionError, ValueError)


def test_ros_arguments_are_dropped():
    arguments = ["--port", "0", "__name:=emulator", "__log:=/tmp/x.log", "joy:=/other/joy", "~rate:=3", "--fps", "30"]
    assert drop_ros_arguments(arguments) == ["--port", "0", "--fps", "30"]


# --- the program ---


def test_says_where_it_listens_answers_there_and_ends_on_a_signal(program):
    emulator = program("__name:=emulator")
    assert emulator.ready["pid"] == emulator.process.pid
    client = XPlaneClient(emulator.port)
    client.subscribe([TIME])
    packet = client.wait(WAIT_S)
    client.close()
    assert packet[:5] == b"RREF,"
    code, errors = emulator.stop(signal.SIGINT)
    assert (code, errors) == (0, "")
    statistics = emulator.line("STOPPED")
    assert statistics["frames"] > 0


def test_ends_after_its_duration(program):
    emulator = program("--duration", 0.5, "--fps", 50)
    assert emulator.process.wait(WAIT_S) == 0
    statistics = emulator.line("STOPPED")
    assert 1 <= statistics["frames"] <= 26


def test_port_in_use_ends_it_with_one_line(program):
    first = program()
    second = subprocess.run(
        [
            sys.executable,
            str(PROGRAM),
            "--model",
            "kinematic",
            "--bind",
            "127.0.0.1",
            "--port",
            str(first.port),
            "--no-beacon",
        ],
        capture_output=True,
        text=True,
        timeout=PROGRAM_S,
        check=False,
    )
    assert second.returncode == 1
    assert f"UDP port {first.port} on 127.0.0.1 is in use" in second.stderr
    assert "--port" in second.stderr
    assert len(second.stderr.strip().splitlines()) == 1


def test_a_bad_scenario_or_truth_file_ends_it_with_one_line(tmp_path):
    bad = tmp_path / "bad.yaml"
    bad.write_text("name: x\nevents: []\n")
    for option, path, message in (
        ("--pilot", bad, "events: []; expected a list of at least one event"),
        ("--truth", tmp_path / "no" / "truth.csv", "cannot be written: No such file"),
    ):
        run = subprocess.run(
            [sys.executable, str(PROGRAM), "--model", "kinematic", "--port", "0", "--no-beacon", option, str(path)],
            capture_output=True,
            text=True,
            timeout=PROGRAM_S,
            check=False,
        )
        assert run.returncode == 1
        assert message in run.stderr
        assert len(run.stderr.strip().splitlines()) == 1


def test_real_time_keeps_its_frames(program):
    """Simulated time is wall time, however late single frames are."""
    fps = 50
    emulator = program("--fps", fps)
    client = XPlaneClient(emulator.port)
    begin = time.monotonic()  # before the first frame is: this process may be stopped when it has come
    client.subscribe([TIME, "sim/operation/misc/frame_rate_period"])
    frames = []  # time and period

    def is_punctual(period):
        return period == pytest.approx(1.0 / fps, abs=1e-5)

    while time.monotonic() < begin + 2.0 or not any(is_punctual(period) for _, period in frames[1:]):
        assert time.monotonic() < begin + WAIT_S, frames
        frame = dict(protocol.decode_rref_response(client.wait(WAIT_S)))
        if len(frame) == 2:  # a frame may have begun between the two requests
            frames.append((frame[0], frame[1]))
    passed = time.monotonic() - begin
    client.close()
    # a machine that stalls the process for more than 50 ms slows simulated time, as X-Plane does: never the other way
    assert frames[-1][0] - frames[0][0] <= passed + 0.2
    assert len(frames) <= (passed + 0.2) * fps
    for (before, _), (now, period) in zip(frames[1:], frames[2:]):  # one after a late first one may not be sent
        assert now - before == pytest.approx(period, abs=1e-4)
        assert period <= 1.0 / 19.9 + 1e-6


# --- stepping ---


def test_stepping_by_lines(program):
    emulator = program("--stepped", "--fps", 60, "--sim-time-start", 10)
    client = XPlaneClient(emulator.port)
    client.subscribe([TIME])
    emulator.say("3")
    assert emulator.line("STEPPED") == {"frame": 3, "sim_time": pytest.approx(10.05)}
    assert len(client.received()) == 3
    emulator.say("x")
    emulator.say("60")
    assert emulator.line("STEPPED") == {"frame": 63, "sim_time": pytest.approx(11.05)}
    emulator.say("quit")
    assert emulator.process.wait(WAIT_S) == 0
    assert "expected a number of frames or 'quit', got 'x'" in emulator.process.stderr.read()
    client.close()


def test_stepping_ends_with_its_input(program):
    emulator = program("--stepped")
    emulator.process.stdin.close()
    assert emulator.process.wait(WAIT_S) == 0


def test_a_signal_ends_stepping(program):
    assert program("--stepped").stop()[0] == 0


def test_stepped_flights_are_the_same_to_the_last_bit(tmp_path):
    """JSBSim, turbulence and the pilot included; only then are the seeds of use."""
    files = []
    for i, seed in enumerate((3, 3, 4)):
        truth = tmp_path / f"truth{i}.csv"
        subprocess.run(
            [
                sys.executable,
                str(PROGRAM),
                "--port",
                "0",
                "--no-beacon",
                "--stepped",
                "fast",
                "--duration",
                "8",
                "--truth",
                str(truth),
                "--turbulence",
                "1.5",
                "--seed",
                str(seed),
                "--pilot",
                str(PROGRAM.parents[1] / "config/scenarios/demo.yaml"),
            ],
            check=True,
            capture_output=True,
            timeout=120,
        )
        files.append(truth.read_bytes())
    assert files[0] == files[1]
    assert files[0] != files[2]


# --- truth ---


def test_truth_is_what_was_sent_in_doubles(tmp_path):
    path = tmp_path / "truth.csv"
    with EmulatorFixture(aircraft="fixed_wing", truth=path, fps=60.0) as bench:
        client = bench.client()
        names = ("local_x", "latitude", "true_psi")
        client.subscribe([TIME, *(f"sim/flightmodel/position/{name}" for name in names)])
        bench.step(30)
        sent = [dict(protocol.decode_rref_response(packet)) for packet in client.received()]
    rows = list(csv.DictReader(path.open()))
    assert len(rows) == len(sent) == 30
    assert list(rows[0])[: len(COLUMNS)] == [name for name, _ in COLUMNS]
    assert [int(row["frame"]) for row in rows] == list(range(1, 31))
    for row, values in zip(rows, sent):
        for index, column in enumerate(("sim_time", "local_x_m", "latitude_deg", "heading_deg")):
            assert struct.unpack("<f", struct.pack("<f", float(row[column])))[0] == values[index]
    assert float(rows[5]["latitude_deg"]) != struct.unpack("<f", struct.pack("<f", float(rows[5]["latitude_deg"])))[0]
    assert "surface_wing2l_ail1_deg" in rows[0] or any(key.startswith("surface_wing") for key in rows[0])
    assert math.isnan(float(rows[0]["host_time"]))  # stepped: there is no host time


def test_truth_is_consistent_in_itself(tmp_path):
    path = tmp_path / "truth.csv"
    pilot = PROGRAM.parents[1] / "config" / "scenarios" / "demo.yaml"
    with EmulatorFixture(aircraft="fixed_wing", truth=path, fps=60.0, pilot=pilot) as bench:
        bench.step(60 * 12)
    rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(path.open())]
    radius = 6378145.0
    for a, b in zip(rows[60:], rows[61:]):
        dt = b["sim_time"] - a["sim_time"]
        north = math.radians(b["latitude_deg"] - a["latitude_deg"]) * (radius + a["altitude_m"]) / dt
        assert north == pytest.approx((a["v_north_mps"] + b["v_north_mps"]) / 2, abs=0.05)
        down = -(b["altitude_m"] - a["altitude_m"]) / dt
        assert down == pytest.approx((a["v_down_mps"] + b["v_down_mps"]) / 2, abs=0.05)


# --- beacon ---


def received(listener):
    """A datagram, who sent it, and when it arrived [s]: not when this process had time for it."""
    packet, ancillary, _, sender = listener.recvmsg(2000, 64)
    ((_, _, stamp),) = ancillary
    seconds, nanoseconds = struct.unpack("qq", stamp)
    return packet, sender, seconds + 1e-9 * nanoseconds


def test_beacon_announces_the_port_each_second(program):
    group = "239.255.1.1"
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        listener.bind(("0.0.0.0", 0))  # a port of our own: other tests announce themselves too
        member = struct.pack("4s4s", socket.inet_aton(group), socket.inet_aton("127.0.0.1"))
        listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        listener.settimeout(WAIT_S)
        listener.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        emulator = program("--version", 12, "--beacon-target", f"{group}:{listener.getsockname()[1]}")
        (packet, sender, first), (_, _, second) = received(listener), received(listener)
    finally:
        listener.close()
    beacon = protocol.decode_beacon(packet)
    assert (beacon.port, beacon.version) == (emulator.port, 122015)
    assert (beacon.major, beacon.minor, beacon.host_id, beacon.role) == (1, 2, 1, 1)
    assert beacon.raknet_port == 49010
    assert beacon.host_name == socket.gethostname()
    assert sender[0] == "127.0.0.1"
    assert 0.5 < second - first < WAIT_S
