"""What cannot be is refused by every program and launch file: with its exit code, in words, without a traceback.

Each row: what is typed, the exit code, and words that must be there, of what was given, of what there is or what is
expected. The files they name are made by the fixture `folder`.
"""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import pytest

from support.flights.synthetic_flight import FlightBag, stamp_ns, write_states
from xplane_bridge.harness import RosMaster
from xplane_bridge.resources import program

ROOT = Path(__file__).resolve().parents[3]
NO_BAG = "not a ROS 1 bag (it does not start with '#ROSBAG V')"
AIRCRAFT = "rv10, tiltrotor; or a file of your own with aircraft_file:=PATH"
JOYSTICKS = "there is logitech_extreme_3d_pro, logitech_f710, playstation, xbox, xplane; or a file of your own"
SCENARIOS = "has: approach.yaml, blocked_pitot.yaml, bus_failure.yaml, conflict.yaml, demo.yaml, demo_flight.yaml"
UNPARSED = "broken.yaml: does not parse as YAML: line 3, column 1: expected the node content"

PROGRAMS = [
    ("aircraft_config --port 70000", 2, ["'70000' is no UDP port; expected 1..65535"]),
    ("aircraft_config --port 9", 1, ["X-Plane does not answer at 127.0.0.1:9", "scripts/xplane_doctor"]),
    ("aircraft_config --host no.such.host.invalid", 1, ["no.such.host.invalid: ", "X-Plane's computer"]),
    ("aircraft_config --hover-throttle 2", 2, ["--hover-throttle: 2: expected a lever position from 0 to 1"]),
    ("bag_export", 2, ["no BAG given"]),
    ("bag_export none.bag", 1, ["none.bag: No such file or directory"]),
    ("bag_export text.bag", 1, ["text.bag: " + NO_BAG, "0 of 1 flights exported"]),
    ("bag_export cut.bag", 1, ["cut.bag: damaged or truncated", "rosbag reindex"]),
    ("bag_export nothing_in_it", 1, ["nothing_in_it: a directory without any .bag file"]),
    ("bag_export good.bag --rate fast", 2, ["--rate: fast: expected a number above 0"]),
    ("bag_export good.bag --train-share 2", 2, ["--train-share: 2: expected a share from 0 to 1"]),
    ("bag_export good.bag --format xml", 2, ["'xml' (choose from 'csv', 'parquet', 'npz', 'mat', 'tum',"]),
    (
        "bag_export good.bag --format tum --topics odom",
        2,
        ["--topics is not for tum; it is for csv, parquet, npz, mat, mcap, ros2"],
    ),
    ("bag_export good.bag --topics engine", 1, ["no topic /xplane/engine", "there is: /xplane/flight_state"]),
    ("bag_export good.bag -o text.bag", 1, ["text.bag: File exists; -o takes a folder that can be written"]),
    ("bag_export --verify -o nothing_in_it", 1, ["no readable manifest.json", "export first"]),
    ("flight_report empty.bag", 1, ["empty.bag: the file is empty; the recording never wrote to it"]),
    ("flight_report link.bag", 1, ["link.bag: no flight state in it", "record flight_state"]),
    ("flight_report good.bag -o nothing_in_it", 1, ["nothing_in_it: Is a directory"]),
    ("estimate_latency good.bag", 1, ["no camera images; record camera/image_raw/compressed"]),
    ("estimate_latency", 2, ["give a BAG, or --live SECONDS"]),
    ("estimate_latency good.bag --live 20", 2, ["give a BAG, or --live SECONDS"]),
    ("estimate_latency --live 1", 2, ["--live: 1: expected 5 to 600 s"]),
    ("estimate_latency good.bag --ignore-bottom 2", 2, ["--ignore-bottom: 2: expected a share from 0 to 0.9"]),
    ("estimate_latency good.bag --plot delay.foo", 2, ["delay.foo: expected a file name that ends in one of", "png"]),
    ("run_scenario nothing", 1, ["nothing.yaml does not exist", SCENARIOS]),
    ("run_scenario broken.yaml", 1, [UNPARSED]),
    ("run_scenario typo.yaml", 1, ["typo.yaml: scenario.evnts: unknown key; expected one of name", "events"]),
    ("run_scenario soon.yaml", 1, ["soon.yaml: events[0].at: 'soon'; expected a number"]),
    ("run_scenario left_aileron_stuck --aircraft zeppelin", 1, ["is for fixed_wing, not for zeppelin"]),
    ("run_scenario left_aileron_stuck --joystick wheel", 1, ["wheel.yaml does not exist", "xbox.yaml"]),
    ("run_scenario left_aileron_stuck --duration -1", 2, ["--duration: -1: expected a number above 0"]),
    ("run_scenario left_aileron_stuck --output text.bag", 1, ["text.bag cannot be written to: Not a directory"]),
    ("run_scenario demo", 1, ["demo repeats for ever", "give --duration"]),
    ("scenario_player nothing", 1, [SCENARIOS]),
    ("scenario_player left_aileron_stuck --joystick --joy-config wheel", 1, ["wheel.yaml does not exist"]),
    ("virtual_joystick broken.yaml", 1, [UNPARSED]),
    ("virtual_joystick left_aileron_stuck --joy-config broken.yaml", 1, [UNPARSED]),
    ("attitude_hold --heading north", 2, ["--heading: north: expected degrees"]),
    ("attitude_hold --speed nan", 2, ["--speed: nan: expected metres per second"]),
    ("fly_controller xplane_bridge.controllers.twin:Zeppelin", 1, ["'xplane_bridge.controllers.twin:Zeppelin' cannot"]),
    ("fly_controller xplane_bridge.controllers.twin:Hold --arguments fast", 1, ["'fast': expected a mapping"]),
    (
        "fly_controller xplane_bridge.controllers.twin:Hold --arguments {fast:1}",
        1,
        ["arguments: xplane_bridge.controllers.twin:Hold does not take them", "fast"],
    ),
    ("fly_controller collections:Counter", 1, ["collections:Counter has no method fly"]),
    ("fly_controller math:sin --arguments {fast:1}", 1, ["math:sin is a function, which takes the state alone"]),
    ("joy_config_check wheel", 1, ["wheel.yaml does not exist", "xbox.yaml"]),
    ("identify_model empty.bag", 1, ["empty.bag: the file is empty; the recording never wrote to it"]),
    ("identify_model good.bag", 1, ["good has no", "record all topics (launch/record.launch)"]),
    ("identify_model good.bag --tail -1", 2, ["--tail: -1: expected a time from 0 to 60 s"]),
    ("linearise_model glider", 1, ["unknown aircraft 'glider': the emulator has fixed_wing"]),
    ("linearise_model fixed_wing --speed 0", 2, ["--speed: 0: expected a number above 0"]),
    ("live_plot /x/y --window 0", 2, ["--window: 0: expected a number above 0"]),
    ("xplane_emulator --aircraft zeppelin", 2, ["--aircraft zeppelin: expected one of fixed_wing, multirotor"]),
    ("xplane_emulator --port 99999", 2, ["--port 99999: expected 0..65535"]),
    ("xplane_emulator --fps 0", 2, ["--fps 0.0: expected 1..500"]),
    ("xplane_emulator --pilot none.yaml", 2, ["--pilot none.yaml: expected an existing file"]),
    ("xplane_emulator --pilot broken.yaml", 1, [UNPARSED]),
    ("check_launch bag=/nonexistent/flight.bag", 1, ["there is no folder /nonexistent; make it, then record"]),
    ("mavros_relay --engage", 2, ["--engage needs --set-points", "multirotor"]),
    ("check_launch prt=49000", 2, ["'prt=49000': expected KEY=VALUE", "port"]),
]

LAUNCHES = [
    ("bridge.launch aircraft:=zeppelin", 1, ["(aircraft:=zeppelin)", AIRCRAFT]),
    ("tx.launch aircraft:=zeppelin", 1, ["(aircraft:=zeppelin)", AIRCRAFT]),
    ("demo.launch aircraft:=zeppelin", 1, ["(aircraft:=zeppelin)", AIRCRAFT]),
    ("tx.launch aircraft_file:=none.yaml", 1, ["aircraft_file:=none.yaml: No such file or directory"]),
    ("bridge.launch port:=many", 1, ["port:=many: expected a whole number"]),
    ("demo.launch xplane_version:=twelve", 1, ["xplane_version:=twelve: expected a whole number"]),
    ("rx.launch max_publish_rate:=fast", 1, ["max_publish_rate:=fast: expected a number"]),
    ("bridge.launch rx:=perhaps", 1, ["rx:=perhaps: expected true or false"]),
    ("rx.launch required:=1", 1, ["required:=1: expected true or false, as a word"]),
    ("rx.launch rx_config:={}/broken.yaml", 1, [UNPARSED]),
    ("joystick.launch joy_config_file:={}/empty_section.yaml", 1, ["empty_section.yaml: buttons has no value"]),
    ("rx.launch common_config:={}/list.yaml", 1, ["list.yaml: is YAML, but no list of `key: value`"]),
    ("rx.launch common_config:={}/strange.yaml", 1, ["take out publish_tf (belongs into rx_config), hots (unknown)"]),
    ("capture.launch capture_config:={}/nothing_in_it", 1, ["nothing_in_it: Is a directory"]),
    ("capture.launch image_rate:=fast", 1, ["image_rate:=fast: expected a number"]),
    ("joystick.launch joy_config:=wheel", 1, ["(joy_config:=wheel)", JOYSTICKS]),
    ("bridge.launch joystick:=mapper joy_config:=wheel", 1, ["(joy_config:=wheel)", JOYSTICKS]),
    ("joystick.launch stick_mode:=left", 1, ["stick_mode:=left: expected a whole number"]),
    (
        "joystick.launch driver:=bluetooth",
        1,
        ["driver:=bluetooth is unknown: expected joy, sdl, virtual, xplane or none"],
    ),
    ("failure.launch scenario:=nothing", 1, ["scenario:=nothing: ", SCENARIOS]),
    ("failure.launch scenario:={}/typo.yaml", 1, ["typo.yaml: scenario.evnts: unknown key; expected one of"]),
    ("failure.launch scenario:=typo.yaml", 1, ["relative path; give the full one, e.g. scenario:=$PWD/typo.yaml"]),
    ("record.launch split_size:=big", 1, ["split_size:=big: expected a whole number"]),
    ("record.launch bag:=/nonexistent/flight.bag", 1, ["there is no folder /nonexistent; make it, then record"]),
    ("record.launch prefix:=flights/one", 1, ["prefix:=flights/one: there is no folder ", "/flights; make it"]),
    ("record.launch compression:=zip", 1, ["compression:=zip: expected one of none, lz4, bz2"]),
    ("bridge.launch joystick:=wheel", 1, ["joystick:=wheel: expected one of none, mapper, joy, sdl, virtual, xplane"]),
    ("failure.launch scenario:=left_aileron_stuck joystick:=yes", 1, ["joystick:=yes: expected true or false"]),
    (
        "failure.launch scenario:=left_aileron_stuck joystick:=true joy_config:=wheel",
        1,
        ["(joy_config:=wheel)", JOYSTICKS],
    ),
    ("camera.launch camera:=camera", 1, ["camera:=camera: the first camera has camera_down_optical, "]),
    ("camera.launch camera:=wing-left", 1, ["camera:=wing-left: expected letters, digits and underscores"]),
    ("camera.launch window_index:=left", 1, ["window_index:=left: expected a whole number"]),
    ("camera.launch capture_config:={}/strange.yaml", 1, ["give window_index:=1, or window: {index: 1} in the file"]),
    ("camera.launch heading:=north", 1, ["heading:=north: expected a number"]),
    ("camera.launch field_of_view:=wide", 1, ["field_of_view:=wide: expected a number, or main"]),
    ("mavros.launch engage:=perhaps", 1, ["engage:=perhaps: expected true or false"]),
    ("mavros.launch engage:=true", 1, ["engage:=True: needs set_points:=true"]),
    ("mavros.launch aircraft:=zeppelin", 1, ["(aircraft:=zeppelin)", AIRCRAFT]),
    ("two_bridges.launch first_host:=127.0.0.1 second_host:=127.0.0.1 first_port:=a", 1, ["port:=a: expected a whole"]),
    (
        "two_bridges.launch first_host:=127.0.0.1 second_host:=127.0.0.1 second_aircraft:=zeppelin",
        1,
        ["(aircraft:=zeppelin)", AIRCRAFT],
    ),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bad")
    write_states(path / "good.bag", 1.0, 50.0)
    with FlightBag(path / "link.bag") as bag:
        bag.add("/xplane/link_state", "xplane_bridge/LinkState", stamp_ns(0), {"state": 0})
    (path / "cut.bag").write_bytes((path / "good.bag").read_bytes()[:3000])
    (path / "empty.bag").write_bytes(b"")
    (path / "text.bag").write_text("hello\n")
    (path / "broken.yaml").write_text("name: x\nevents: [\n")
    (path / "typo.yaml").write_text("name: x\nevnts: []\n")
    (path / "soon.yaml").write_text("name: x\nevents:\n  - {at: soon, end: true}\n")
    (path / "list.yaml").write_text("- a\n- b\n")
    (path / "strange.yaml").write_text("host: 127.0.0.1\npublish_tf: true\nhots: 127.0.0.1\n")
    (path / "empty_section.yaml").write_text("device: Pad\nbuttons:\n  # gear: {button: 3}\n")
    (path / "nothing_in_it").mkdir()
    return path


def check(words: list[str], folder: Path, env: dict[str, str], code: int, expected: list[str]) -> None:
    run = subprocess.run(words, cwd=folder, env=env, capture_output=True, text=True, timeout=120, check=False)
    said = run.stdout + run.stderr
    assert run.returncode == code, said
    for part in expected:
        assert part in said, said
    assert "Traceback" not in said


@pytest.mark.parametrize(("typed", "code", "expected"), PROGRAMS)
def test_a_program_refuses(master: RosMaster, folder: Path, typed: str, code: int, expected: list[str]) -> None:
    name, *arguments = typed.split()
    check([str(program(name)), *arguments], folder, master.env, code, expected)


@pytest.mark.parametrize(("typed", "code", "expected"), LAUNCHES)
def test_a_launch_file_refuses(master: RosMaster, folder: Path, typed: str, code: int, expected: list[str]) -> None:
    words = ["roslaunch", "xplane_bridge", *typed.format(folder).split()]
    check(words, folder, master.env, code, expected)


def test_an_argument_that_roslaunch_ignores_is_missing_in_the_nodes_first_line(world: Any) -> None:
    readme = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    assert "roslaunch itself ignores misspelt arguments; each node's first line lists what it was given" in readme
    launch = world.launch("rx.launch", "hots:=192.0.2.9", "host:=127.0.0.1", "port:=9")
    given = launch.wait_for_line(r"rx_node starts with (.*)", 60).group(1)
    assert 'host: "127.0.0.1"' in given
    assert "port: 9" in given
    assert "192.0.2.9" not in given
