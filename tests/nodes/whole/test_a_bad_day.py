"""A bad day: the controller dies in flight, X-Plane dies after it, and the recording says so."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
from pathlib import Path
from typing import Any

from support.deadlines import WAIT_S
from support.nodes.tx_fixtures import AUTO, MANUAL, tx_params
from xplane_bridge.harness import ManagedProcess, wait_until
from xplane_bridge.harness.ros import roslaunch
from xplane_bridge.resources import program

CSV, EUROC = "flight.csv", "flight.euroc.csv"


def run(name: str, *arguments: Any) -> str:
    command = [program(name), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def flies_for(state: Any, seconds: float) -> list[Any]:
    """The states of so much simulator time from now on."""
    first, begun = len(state.messages), state.last.sim_time
    wait_until(lambda: state.last.sim_time > begun + seconds, 60, f"{seconds} s of flight")
    return state.messages[first:]


def test_a_controller_and_x_plane_die_and_the_recording_says_so(world) -> None:
    from xplane_bridge.msg import ControlMode, EventList, FlightState

    xplane = world.emulator("--start", "air")
    world.set_param("aircraft", "fixed_wing")
    world.start("rx_node")
    bridge = world.start("tx_node", tx_params())
    mode, events = world.watch("control/mode", ControlMode), world.watch("events", EventList)
    state = world.watch("flight_state", FlightState)
    bag = world.folder / "flight.bag"
    recorder = roslaunch(world.master, world.folder, "record.launch", ns=world.namespace.strip("/"), bag=bag)
    recorder.start()
    wait_until(bag.with_suffix(".bag.active").exists, 60, "recording")

    hold = [program("attitude_hold"), "--engage", "--roll", "15", "--namespace", world.namespace]
    controller = ManagedProcess("hold", hold, world.folder, env=world.env)
    controller.start()
    mode.wait_for(lambda m: m.mode == AUTO and m.auto_alive and not m.failsafe, 60)
    wait_until(lambda: abs(state.last.roll_deg - 15.0) < 3.0, 60, "the turn")

    controller.send_signal(signal.SIGKILL)
    controller.wait(WAIT_S)
    dead = mode.wait_for(lambda m: m.failsafe)
    assert (dead.mode, dead.reason) == (AUTO, "timeout of control/auto")
    events.wait_for(lambda e: any(event.text == "AUTO: failsafe: timeout of control/auto" for event in e.events))
    wait_until(lambda: "AUTO: failsafe: timeout of control/auto" in bridge.output(), WAIT_S, "the warning")
    height = state.last.altitude_msl
    drifted = flies_for(state, 10.0)
    assert max(abs(later.altitude_msl - height) for later in drifted) < 60.0

    mode.skip_to_now()
    xplane.restart()
    off = mode.then_wait_for(lambda m: m.mode == MANUAL, WAIT_S)
    assert off.reason.startswith("X-Plane was restarted")
    state.wait_for_next(timeout=WAIT_S)
    flies_for(state, 5.0)
    assert mode.last.mode == MANUAL, "AUTO came back by itself"
    recorder.stop()
    wait_until(bag.exists, WAIT_S, "the end of the recording")

    page = world.folder / "flight.html"
    run("flight_report", bag, "-o", page)
    assert '<span class="bad">failsafe</span></td><td>timeout of control/auto' in page.read_text(encoding="utf-8")
    folder = world.folder / "tables"
    run("bag_export", bag, "--format", "csv", "-o", folder)
    table = (folder / CSV).read_bytes()
    run("bag_export", bag, "--format", "euroc", "-o", folder)
    assert (folder / CSV).read_bytes() == table, "the tables are not written over"
    assert (folder / EUROC).is_file()
    assert "failsafe" not in (folder / EUROC).read_text(encoding="utf-8").splitlines()[0]
    exports = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["exports"]
    assert sorted(exports) == ["csv", "euroc"]
    run("bag_export", "--verify", "-o", folder)
    check_table(folder / CSV)


def check_table(file: Path) -> None:
    """AUTO (2), its failsafe, and MANUAL (1) from X-Plane's end on."""
    with file.open(encoding="utf-8") as text:
        flown = [(row["mode"], row["failsafe"]) for row in csv.DictReader(text) if row["failsafe"]]
    order = [now for before, now in zip([("", ""), *flown], flown) if now != before]
    assert ("2", "False") in order
    assert ("2", "True") in order
    assert order.index(("2", "False")) < order.index(("2", "True"))
    assert order[-1] == ("1", "False")
