"""The panic tool where one journal, entry or X-Plane is not as it should be: all others are released."""

from __future__ import annotations

import fcntl
import json
import os
import re
import socket
import struct
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple

import pytest

from support.journals import NO_WAY, STICK, THROTTLES, TOOL, entry, ids, override, release, write
from xplane_bridge.harness.ports import free_udp_port


class XPlane:
    """Takes DREF, answers RREF once."""

    def __init__(self) -> None:
        self.values: Dict[str, float] = {STICK: 1.0, THROTTLES: 1.0}
        self.rows: List[Tuple[int, Tuple[float, ...]]] = []
        self.on_write: Callable[[], object] = lambda: None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while True:
            packet, client = self._socket.recvfrom(2048)
            if packet[:4] == b"DREF":
                self.on_write()
                if _path(packet[9:]) in self.values:
                    self.values[_path(packet[9:])] = struct.unpack_from("<f", packet, 5)[0]
            elif packet[:4] == b"DATA":
                row, *values = struct.unpack_from("<i8f", packet, 5)
                self.rows.append((row, tuple(values)))
            elif packet[:4] == b"RREF":
                rate, index = struct.unpack_from("<ii", packet, 5)
                if rate:
                    answer = struct.pack("<if", index, self.values.get(_path(packet[13:]), -1.0))
                    self._socket.sendto(b"RREF," + answer, client)


def _path(text: bytes) -> str:
    return text.split(b"\0")[0].decode()


@pytest.fixture
def left(tmp_path: Path) -> Tuple[XPlane, Path]:
    """An X-Plane with two overrides, and the journal that has them."""
    xplane = XPlane()
    return xplane, write(tmp_path / f"127.0.0.1_{xplane.port}.json", override(STICK), override(THROTTLES))


def test_an_empty_folder_is_the_usual_one(tmp_path: Path) -> None:
    (tmp_path / "xplane_bridge").mkdir()
    write(tmp_path / "xplane_bridge" / "127.0.0.1_49000.json", override(STICK))
    command = [sys.executable, str(TOOL), "--list", "--folder", ""]
    done = subprocess.run(
        command, env={**os.environ, "ROS_HOME": str(tmp_path)}, stdout=subprocess.PIPE, text=True, check=True
    )
    assert STICK in done.stdout


def test_all_is_released_and_taken_out(left: Tuple[XPlane, Path]) -> None:
    xplane, journal = left
    done = release(journal)
    assert done.returncode == 0, done.stdout + done.stderr
    assert set(xplane.values.values()) == {0.0}
    assert not journal.exists()


def test_a_locked_journal_is_listed_and_all_is_released(left: Tuple[XPlane, Path]) -> None:
    xplane, journal = left
    with open(f"{journal}.lock", "a", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert THROTTLES in release(journal, "--list").stdout
        done = release(journal)
    assert done.returncode == 1
    assert done.stdout.count(": released") == 2
    assert f"{journal}: a node is writing it, or was stopped while it did" in done.stdout
    assert set(xplane.values.values()) == {0.0}
    assert len(json.loads(journal.read_text("utf-8"))["entries"]) == 2
    assert release(journal).returncode == 0
    assert not journal.exists()


def test_where_nothing_can_be_sent_is_said_and_the_next_x_plane_is_released(left: Tuple[XPlane, Path]) -> None:
    xplane, journal = left
    second = journal.rename(journal.with_name(f"localhost_{xplane.port}.json"))  # sorted behind
    unseen = entry("data_output:26", {"op": "data", "row": 26, "values": [-999.0] * 8})
    first = write(journal.with_name(f"{NO_WAY}_49000.json"), override(STICK), unseen)
    asked = entry(
        "subscriptions:/rx_node", subscriptions=[{"port": free_udp_port(), "datarefs": [STICK], "rpos": True}]
    )
    ports = write(journal.with_name(f"{NO_WAY}_49000_subscriptions.json"), asked)
    done = release(first)
    assert done.returncode == 1
    assert done.stderr == ""
    assert done.stdout.count("nothing can be sent there (Permission denied); kept in the journal") == 3, done.stdout
    assert set(xplane.values.values()) == {0.0}
    assert not second.exists()
    assert ids(first) == ["override:" + STICK, "data_output:26"]
    assert ids(ports) == ["subscriptions:/rx_node"]


def test_all_says_where_nothing_can_be_sent(tmp_path: Path) -> None:
    done = release(tmp_path / "none.json", "--all", "--host", NO_WAY)
    assert done.returncode == 1
    assert done.stderr == ""
    assert done.stdout.count("nothing can be sent there (Permission denied)") == 9


def test_all_are_those_of_other_aircraft_and_of_the_engines_too(tmp_path: Path) -> None:
    xplane = XPlane()
    names = re.findall(r'\("(sim/operation/override/override_[a-z_]+)"', TOOL.read_text("utf-8"))
    aircraft = [f"sim/operation/override/override_planepath[{number}]" for number in range(20)]
    xplane.values = dict.fromkeys((*names, *aircraft, "sim/flightmodel/engine/ENGN_thro_override"), 1.0)
    done = release(tmp_path / "none.json", "--all", "--host", "127.0.0.1", "--port", str(xplane.port))
    assert done.returncode == 0, done.stdout
    assert xplane.values.pop("sim/flightmodel/engine/ENGN_thro_override") == -2.0  # what gives the levers back
    assert set(xplane.values.values()) == {0.0}
    assert "override_planepath[0..19]: released" in done.stdout


def test_all_gives_back_the_rows_of_data_output_too(tmp_path: Path) -> None:
    xplane = XPlane()
    done = release(tmp_path / "none.json", "--all", "--port", str(xplane.port))
    assert {row: set(values) for row, values in xplane.rows} == {row: {-999.0} for row in (8, 11, 13, 25)}
    assert len(xplane.rows) >= 3 * 4  # one may be lost, and X-Plane shows none
    assert "rows 8, 11, 13, 25: -999 sent, which X-Plane does not confirm" in done.stdout


@pytest.mark.parametrize(("shown", "lever"), [(1.0, 0.6), (0.0, 0.2)])
def test_levers_go_where_the_motors_were_while_x_plane_does_not_fly_them(
    tmp_path: Path, shown: float, lever: float
) -> None:
    """An X-Plane that was started since has its throttles and levers of its own."""
    xplane = XPlane()
    path = "sim/cockpit2/engine/actuators/throttle_ratio[0]"
    xplane.values = {THROTTLES: shown, path: 0.2}
    motors = {"op": "dref", "path": path, "value": 0.6, "confirm": False}
    throttles = entry("override:" + THROTTLES, motors, {"op": "dref", "path": THROTTLES, "value": 0.0})
    journal = write(tmp_path / f"127.0.0.1_{xplane.port}.json", throttles)
    assert release(journal).returncode == 0
    assert xplane.values == {THROTTLES: 0.0, path: pytest.approx(lever)}
    assert not journal.exists()


def test_what_x_plane_does_not_confirm_goes_back_whatever_it_shows(tmp_path: Path) -> None:
    """The wind before a disturbance: its last operation usually shows its value already."""
    xplane = XPlane()
    xplane.values = {"sim/weather/wind_speed_kt[0]": 30.0, "sim/weather/use_real_weather_bool": 0.0}
    back = zip(xplane.values, (5.0, 0.0))
    undo = [{"op": "dref", "path": path, "value": value, "confirm": False} for path, value in back]
    journal = write(tmp_path / f"127.0.0.1_{xplane.port}.json", entry("disturbance", *undo))
    assert release(journal).returncode == 0
    assert list(xplane.values.values()) == [5.0, 0.0]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--list", "--all"], "--list and --all exclude each other"),
        (["--host", "127.0.0.1"], "--host and --port go with --all"),
        (["--port", "49001"], "--host and --port go with --all"),
    ],
)
def test_options_that_would_do_nothing_are_refused(tmp_path: Path, given: List[str], words: str) -> None:
    done = release(tmp_path / "none.json", *given)
    assert done.returncode == 2
    assert words in done.stderr


@pytest.mark.parametrize("in_the_way", [".lock", ".new"])
def test_a_journal_that_cannot_be_changed_holds_up_nothing(left: Tuple[XPlane, Path], in_the_way: str) -> None:
    xplane, journal = left
    asked = entry(
        "subscriptions:/rx_node", subscriptions=[{"port": free_udp_port(), "datarefs": [STICK], "rpos": False}]
    )
    kept = entry("subscriptions:/gone", subscriptions=[{"port": xplane.port, "datarefs": [], "rpos": False}])
    ports = write(journal.with_name(f"{journal.stem}_subscriptions.json"), asked, kept)
    for each in (journal, ports):
        each.with_name(each.name + in_the_way).mkdir()  # refused to root as well, unlike a file of another user
    unknown = override("sim/no/such_dataref")  # stays, and so does the file
    write(journal, override(STICK), override(THROTTLES), entry("data_output:26", {"op": "usel", "rows": [26]}), unknown)
    (journal.parent / f"localhost_{xplane.port}.json").write_text(journal.read_text("utf-8"), "utf-8")
    done = release(journal)
    assert done.returncode == 1
    assert done.stderr == ""
    assert done.stdout.count(": released") == 6
    assert "1 subscriptions of /tx_node, process 1: ended" in done.stdout
    for each in (journal, ports):
        assert done.stdout.count(f"{each}: cannot be changed (Is a directory): what was released stays in it") == 1
    assert "sudo" in done.stdout
    assert set(xplane.values.values()) == {0.0}
    assert ids(journal.with_name(f"localhost_{xplane.port}.json")) == ["override:sim/no/such_dataref"]


def test_a_full_disk_keeps_no_journal_of_which_all_is_released(left: Tuple[XPlane, Path]) -> None:
    _, journal = left
    journal.with_name(journal.name + ".new").mkdir()  # nothing can be written, but the journal can be deleted
    done = release(journal)
    assert done.returncode == 0, done.stdout + done.stderr
    assert not journal.exists()


def test_a_journal_that_is_damaged_meanwhile_holds_up_nothing(left: Tuple[XPlane, Path]) -> None:
    xplane, journal = left
    xplane.on_write = lambda: journal.write_text("{", "utf-8")
    done = release(journal)
    assert done.returncode == 1
    assert done.stderr == ""
    assert set(xplane.values.values()) == {0.0}
    assert done.stdout.count(f"{journal}: cannot be changed (") == 1


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            ["--host", "no-such-host.invalid"],
            ["--host: 'no-such-host.invalid' has no address", "IPv4 address"],
        ),
        (["--host", "a..b"], ["argument --host: 'a..b' has no address"]),
        (["--port", "99999"], ["argument --port: port '99999'; expected 1 to 65535", "49000"]),
        (["--port", "0"], ["argument --port: port '0'"]),
        (["--port", "x"], ["argument --port: port 'x'"]),
    ],
)
def test_a_host_or_port_that_is_none_is_said(tmp_path: Path, given: List[str], words: List[str]) -> None:
    done = release(tmp_path / "none.json", "--all", *given)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert all(word in done.stderr for word in words), done.stderr


@pytest.mark.parametrize("content", ["[]", "{}", "{", "\x00", '{"format": "xplane_bridge journal", "version": 1}'])
@pytest.mark.parametrize("suffix", ["", "_subscriptions"])
def test_what_is_no_journal_holds_up_nothing(left: Tuple[XPlane, Path], content: str, suffix: str) -> None:
    xplane, journal = left
    damaged = journal.with_name(f"1.1.1.1_49000{suffix}.json")  # sorted before
    damaged.write_text(content, "utf-8")
    journal.with_name(f"1.1.1.1_99999{suffix}.json").write_text("[]", "utf-8")
    done = release(journal)
    assert done.returncode == (0 if suffix else 1)
    assert "Traceback" not in done.stderr
    assert f"{damaged}: " in done.stderr
    assert "port '99999'; expected 1 to 65535" in done.stderr
    assert set(xplane.values.values()) == {0.0}
    assert not journal.exists()
    assert damaged.read_text("utf-8") == content


DREF = {"op": "dref", "path": STICK, "value": 0.0}
DAMAGED = [
    (entry("x", {"op": "teleport"}), "operation 'teleport' is not known"),
    (entry("x", {"op": "dref", "path": STICK}), "'value' is missing"),
    (entry("x", {"op": "dref", "path": "h\u00f6he", "value": 0.0}), "ascii"),
    (entry("x", {"op": "dref", "path": STICK, "value": 1e300}), "too large"),
    (entry("x", {"op": "data", "row": 26, "values": [0.0]}), "9 items"),
    (entry("x", "dref"), "indices"),
    ({"id": "x", "undo": [DREF]}, "'owner' is missing"),
    ({**entry("x", DREF), "id": 7}, "its id"),
    (17, "subscriptable"),
]


@pytest.mark.parametrize(("damaged", "why"), DAMAGED)
def test_an_entry_that_cannot_be_carried_out_stays_and_the_others_go(
    left: Tuple[XPlane, Path], damaged: Any, why: str
) -> None:
    xplane, journal = left
    write(journal, damaged, override(STICK), override(THROTTLES))
    done = release(journal)
    assert done.returncode == 1
    assert done.stderr == ""
    assert why in done.stdout
    assert "cannot be carried out" in done.stdout
    assert set(xplane.values.values()) == {0.0}
    assert json.loads(journal.read_text("utf-8"))["entries"] == [damaged]
