"""The test card against the emulator: each question alone, with its switch and without; the journal; refusals."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from support.again import again_until
from support.deadlines import PROGRAM_S, WAIT_S
from support.nodes.forked_emulator import ForkedEmulator
from support.simulator.fake_xplane import FakeXPlane
from xplane_bridge import protocol, xplane_names
from xplane_bridge.cli import xplane_doctor
from xplane_bridge.doctor import names as doctor_names
from xplane_bridge.doctor.conformance import flight, names, results
from xplane_bridge.doctor.conformance import program as conformance
from xplane_bridge.doctor.conformance.journal import Journal
from xplane_bridge.doctor.conformance.questions import CARD
from xplane_bridge.doctor.conformance.verdict import Verdict
from xplane_bridge.doctor.settings import Settings
from xplane_bridge.emulator.datarefs import otherwise
from xplane_bridge.harness import wait_until
from xplane_bridge.harness.xplane_client import XPlaneClient
from xplane_bridge.resources import program

ROOT = Path(__file__).resolve().parents[3]
IDS = [question.id for question in CARD]
#: Needs a window: in tests/nodes.
WITH_WINDOW = {"window-changes"}
#: What a question needs of the emulator beside its switch.
OPTIONS = {"parked-height": ["--start", "ground"], "row1-clock": ["--sim-time-start", "100"]}
#: So many emulators fly side by side: questions wait by the clock, which aircraft below 20 frames a second are behind.
SIDE_BY_SIDE = min(6, 2 * (os.cpu_count() or 1))
#: Half of the usual: a busy machine keeps up with it for longer.
FPS = 30
#: Flies the card and is killed where it first waits, which `hpath` does within its wind.
KILLED = """
import os, signal, sys
from xplane_bridge.cli.xplane_doctor import main
from xplane_bridge.doctor.conformance.flight import Flight
Flight.wait = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
sys.exit(main(sys.argv[1:]))
"""


#: Flies the card as the program does, and says at the end for how long it did not come to run at most [s].
WATCHED = """
import sys, threading, time
from xplane_bridge.cli.xplane_doctor import main
longest = 0.0
def watch():
    global longest
    before = time.monotonic()
    while True:
        time.sleep(0.01)
        now = time.monotonic()
        longest, before = max(longest, now - before), now
threading.Thread(target=watch, daemon=True).start()
try:
    sys.exit(main(sys.argv[1:]))
finally:
    print("stood still for", longest, file=sys.stderr)
"""
DOCTOR = (program("xplane_doctor"),)
#: Longer than this without an answer or without running, a question's windows may be too short [s].
LATE_S = 0.15
#: A question is asked again where what it found may be the machine's.
ATTEMPTS = 4


def emulator_options(id_, switched, version):
    words = ["--version", version, "--priority", "normal", "--fps", str(FPS)]
    return [*words, *OPTIONS.get(id_, []), *(["--otherwise", id_] if switched else [])]


@contextlib.contextmanager
def emulator(*options, ended=None):
    """An emulator in real time; gives its port. What it says of itself at its end is added to `ended`."""
    with tempfile.TemporaryDirectory() as folder:
        with ForkedEmulator(Path(folder), options) as process:
            yield process.port
        if ended is not None:
            ended.append(json.loads(process.output().rpartition("STOPPED ")[2]))


def doctor(port, home, *words, command=DOCTOR):
    """The doctor as users run it: exit code, stdout, stderr."""
    where = ["--host", "127.0.0.1", "--port", str(port), "--conformance"]
    done = subprocess.run(
        [sys.executable, *command, *where, *words],
        env={**os.environ, "ROS_HOME": str(home)},
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
        timeout=PROGRAM_S,
    )
    return done.returncode, done.stdout, done.stderr


# --------------------------------------------------------------------------------------------------- lists in step


def marks():
    """Ids behind the mark of an open question, with the files that have them."""
    command = ["git", "-c", f"safe.directory={ROOT}", "-C", str(ROOT), "ls-files", "-z"]
    listing = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout
    found = {}
    for name in filter(None, listing.split("\0")):
        path = ROOT / name
        if path.suffix in {".py", ".cpp", ".hpp", ".md", ".txt", ".yaml", ".msg", ".srv"} and path.is_file():
            for mark in re.findall(r"\[\?([^\]\n]*)\]", path.read_text(encoding="utf-8")):
                found.setdefault(mark.strip(), set()).add(name)
    return found


def test_each_open_question_in_the_sources_is_on_the_card_and_the_other_way_round():
    found = marks()
    found.pop("id", None)  # where the mark itself is explained
    unnamed = {mark: files for mark, files in found.items() if not re.fullmatch(r"[a-z0-9-]+", mark)}
    # Of regular expressions: [?...] in a pattern.
    assert {mark: files for mark, files in unnamed.items() if mark == ""} == {}
    named = {mark for mark in found if re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", mark)}
    assert named == set(IDS)


def test_each_question_has_a_switch_of_the_emulator_and_a_line_in_the_documentation():
    assert sorted(IDS) == sorted(otherwise.IDS)
    text = (ROOT / "docs/setups/doctor.md").read_text(encoding="utf-8").split("\n## The card\n", 1)[1]
    assert re.findall(r"^\| `([a-z0-9-]+)` \|", text, re.MULTILINE)[1:] == IDS


@pytest.mark.parametrize("version", xplane_names.VERSIONS)
def test_names_of_the_card_are_x_planes(version):
    facts = xplane_names.datarefs(version)

    def fact(path):
        return facts.get(path) or facts.get(re.sub(r"\[\d+\]$", "", path))

    assert [path for path in names.READ if not fact(path)] == []
    assert [path for path in names.WRITTEN if not (fact(path) and fact(path).writable)] == []
    assert [path for path in names.COMMANDS if path not in xplane_names.commands(version)] == []
    regions = version in ("12.08", "12.10")
    wind = (
        (*names.REGION_SPEED, *names.REGION_FROM, *names.REGION_MODE, *names.REGION_WIND_NOW)
        if regions
        else (*names.OLD_WIND_SPEED, *names.OLD_WIND_FROM, *names.OLD_WIND_NOW)
    )
    assert [path for path in wind if not fact(path)] == []
    assert bool(fact(names.AILERON_HARD_OVER)) == version.startswith("12")


# --------------------------------------------------------------------------------------------------- each question


def verdict_of(switched):
    return Verdict.REFUTED if switched else Verdict.CONFIRMED


def asked_alone(id_, switched, version, folder):
    """Exit code, output, file and journal of a question; asked again where it was not answered as it should be while
    emulator or doctor did not come to run."""
    for attempt in range(ATTEMPTS):
        home, ended = folder / str(attempt), []
        with emulator(*emulator_options(id_, switched, version), ended=ended) as port:
            code, out, err = doctor(port, home, "--yes", "--only", id_, command=("-c", WATCHED))
            written = results.file_of(home / "xplane_bridge", "127.0.0.1", port)
            said = json.loads(written.read_text(encoding="utf-8")) if written.is_file() else None
            left = Journal(home / "xplane_bridge", "127.0.0.1", port).orphans()
        answer = code, out, err, said, left
        stood = float(err.rpartition("stood still for ")[2]), 1e-3 * ended[0]["period_error_ms"]["max"]
        found = code == 0 and left == [] and out.startswith(f"{id_}: {verdict_of(switched).value} ")
        if found or max(stood) < LATE_S:
            break
    return answer


CASES = [
    (id_, switched, version)
    for id_ in IDS
    if id_ not in WITH_WINDOW
    for switched in (False, True)
    for version in (("11", "12") if id_ in ("row16", "wind-names") else ("12",))
]


@pytest.fixture(name="asked", scope="module")
def fixture_asked(request, tmp_path_factory):
    """All cases that are run, side by side: each waits for an aircraft to fly most of the time."""
    specs = [getattr(item, "callspec", None) for item in request.session.items]
    cases = [spec.params["case"] for spec in specs if spec is not None and "case" in spec.params]
    with ThreadPoolExecutor(SIDE_BY_SIDE) as pool:
        yield {
            case: pool.submit(asked_alone, *case, tmp_path_factory.mktemp("home")) for case in cases if case in CASES
        }


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case[0]}-{'on' if case[1] else 'off'}-{case[2]}")
def test_a_question_alone_finds_its_switch(asked, case):
    id_, switched, version = case
    code, out, err, said, left = asked[case].result()
    verdict = verdict_of(switched)
    assert code == 0, err
    assert re.fullmatch(rf"{id_}: {verdict.value} \(.*\d.*\)\n", out), out
    assert said["questions"].keys() == {id_}
    assert said["questions"][id_]["verdict"] == verdict.value
    assert xplane_names.version_of(said["xplane_version"]) == xplane_names.NEWEST[version]
    assert left == []


def test_version_11_cannot_show_what_only_12_has(tmp_path):
    with emulator("--version", "11") as port:
        words = "--yes", "--only", "vehs,fcon-acts"
        code, out, err = again_until(lambda done: done[0] == 0, lambda: doctor(port, tmp_path, *words))
    assert code == 0, err
    assert [line.split(" (")[0] for line in out.splitlines()] == ["vehs: not testable", "fcon-acts: not testable"]


# ------------------------------------------------------------------------------------------------ what is refused


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--only", "no-such"], "there is no question no-such; there are: unknown-omitted"),
        ([], "not flown"),
        (["--yes"], "nothing answers on 127.0.0.1:"),
    ],
)
def test_what_cannot_run_says_why(tmp_path, words, says):
    with FakeXPlane({}) as silent:
        code, out, err = doctor(silent.port, tmp_path, *words)
    assert (code, out) == (2, "")
    assert says in err


def test_only_belongs_to_the_card(capsys):
    with pytest.raises(SystemExit) as ended:
        xplane_doctor.main(["--only", "prel"])
    assert ended.value.code == 2
    assert "--conformance" in capsys.readouterr().err


OVERRIDE = names.STICK_OVERRIDES[0]


def entry(node, pid, start_ticks):
    boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    owner = {"node": node, "pid": pid, "start_ticks": start_ticks, "boot_id": boot, "computer": "lab"}
    undo = [{"op": "dref", "path": OVERRIDE, "value": 0.0}]
    return {"id": f"override:{OVERRIDE}", "purpose": "override", "owner": owner, "undo": undo}


def write_journal(home, port, *entries):
    file = home / "xplane_bridge" / f"127.0.0.1_{port}.json"
    file.parent.mkdir(parents=True, exist_ok=True)
    content = {"format": "xplane_bridge journal", "version": 1, "entries": list(entries)}
    file.write_text(json.dumps(content), encoding="utf-8")
    return file


def shown(port, path):
    client = XPlaneClient(port)
    client.subscribe([path], 50)
    try:
        return protocol.decode_rref_response(client.wait(WAIT_S))[0][1]
    finally:
        client.send(protocol.RrefRequest(0, 0, ""))
        client.close()


def test_it_refuses_while_a_tx_node_holds_the_journal(tmp_path):
    with emulator(*emulator_options("", False, "11")) as port:
        ticks = int(Path("/proc/self/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[19])
        file = write_journal(tmp_path, port, entry("/xplane/tx_node", os.getpid(), ticks))
        code, out, err = doctor(port, tmp_path, "--yes", "--only", "prel")
        assert (code, out) == (2, "")
        assert f"/xplane/tx_node (process {os.getpid()}" in err
        assert len(json.loads(file.read_text(encoding="utf-8"))["entries"]) == 1


def test_what_a_dead_node_left_is_undone_first(tmp_path):
    with emulator(*emulator_options("", False, "11")) as port:
        client = XPlaneClient(port)
        client.send(protocol.DrefWrite(OVERRIDE, 1.0))
        client.close()
        file = write_journal(tmp_path, port, entry("/xplane/tx_node", 2**22 + 1, 1))
        assert doctor(port, tmp_path, "--yes", "--only", "same-index")[0] == 0
        assert not file.exists()
        assert shown(port, OVERRIDE) == 0.0


@pytest.mark.parametrize("how", ["release_overrides", "next start"])
def test_a_killed_card_is_undone(tmp_path, how):
    with emulator(*emulator_options("", False, "12")) as port:
        command = [sys.executable, "-c", KILLED, "--host", "127.0.0.1", "--port", str(port)]
        environment = {**os.environ, "ROS_HOME": str(tmp_path)}
        words = ["--conformance", "--yes", "--only", "hpath"]
        card = subprocess.run(
            [*command, *words], env=environment, check=False, stdout=subprocess.DEVNULL, timeout=PROGRAM_S
        )
        assert card.returncode == -signal.SIGKILL
        journal = Journal(tmp_path / "xplane_bridge", "127.0.0.1", port)
        noted = {each["id"] for each in json.loads(journal.file.read_text(encoding="utf-8"))["entries"]}
        assert {f"override:{path}" for path in (*names.REGION_SPEED, *names.STICK_OVERRIDES)} <= noted
        assert shown(port, names.REGION_SPEED[0]) > 10.0
        assert [shown(port, path) for path in names.STICK_OVERRIDES] == [1.0] * 3
        if how == "release_overrides":
            release = [sys.executable, program("release_overrides")]
            subprocess.run(release, env=environment, check=True, stdout=subprocess.DEVNULL)
        else:
            assert doctor(port, tmp_path, "--yes", "--only", "same-index")[0] == 0
        assert [shown(port, path) for path in names.STICK_OVERRIDES] == [0.0] * 3
        assert shown(port, names.REGION_SPEED[0]) == 0.0
        assert not journal.file.exists()


# ------------------------------------------------------------------------------------------- what it asks X-Plane


class Recorder(FakeXPlane):
    """Keeps each request for a dataref, with the client that sent it."""

    def __init__(self, values):
        super().__init__(values)
        self.requests = []

    def _take(self, datagram, client):
        request = protocol.decode_request(datagram)
        if isinstance(request, protocol.RrefRequest):
            self.requests.append((client, request))
        super()._take(datagram, client)


def test_a_subscription_is_ended_by_its_own_request_with_rate_0(tmp_path):
    values = {**dict.fromkeys(names.READ, 0.0), doctor_names.VERSION: 122015.0}
    with Recorder(values) as xplane:
        assert doctor(xplane.port, tmp_path, "--yes", "--only", "same-index,paused-output")[0] == 0
        wait_until(lambda: not any(xplane.subscriptions.values()), WAIT_S, "the end of the last subscription")
        begun, ended = (
            {
                (client, request.index, request.path)
                for client, request in xplane.requests
                if bool(request.rate_hz) is on
            }
            for on in (True, False)
        )
    assert names.EARTH_RADIUS in {path for _, _, path in begun}
    assert begun == ended


# --------------------------------------------------------------------------------------------- what is put back


def test_the_flight_is_put_back_and_answers_of_this_version_are_kept(tmp_path):
    # To the east: its own flight changes the latitude little, however long the programs take; `prel` moves it north.
    with emulator("--alt", "2500", "--heading", "90", *emulator_options("", False, "12")) as port:
        before = shown(port, names.LATITUDE)
        assert doctor(port, tmp_path, "--yes", "--only", "prel")[0] == 0
        assert doctor(port, tmp_path, "--yes", "--only", "unknown-omitted")[0] == 0
        assert shown(port, names.LATITUDE) == pytest.approx(before, abs=0.02)
        assert shown(port, names.ELEVATION) == pytest.approx(2500.0, abs=150.0)
        assert shown(port, names.PAUSED) == 0.0
        file = results.file_of(tmp_path / "xplane_bridge", "127.0.0.1", port)
        assert json.loads(file.read_text(encoding="utf-8"))["questions"].keys() == {"prel", "unknown-omitted"}
        report = file.with_name(file.stem + "_report.txt").read_text(encoding="utf-8")
        assert "prel: confirmed" in report
        assert "X-Plane 122015" in report


def test_a_flight_that_loads_for_long_is_waited_for_and_paused_again(tmp_path):
    options = emulator_options("", False, "12")
    with emulator("--alt", "2500", "--loading-time", "7", *options) as port:
        before = shown(port, names.LATITUDE)
        client = XPlaneClient(port)
        client.send(protocol.CommandRequest(names.PAUSE_TOGGLE))
        client.close()
        code, out, err = doctor(port, tmp_path, "--yes", "--only", "side-sign")
        assert code == 0, err
        assert out.startswith("side-sign: confirmed")
        assert shown(port, names.LATITUDE) == pytest.approx(before, abs=0.02)
        assert shown(port, names.PAUSED) == 1.0


class Silenced(FakeXPlane):
    """Says nothing any more once a situation is to be loaded."""

    def _take(self, datagram, client):
        super()._take(datagram, client)
        if isinstance(protocol.decode_request(datagram), protocol.Situation):
            self._values.clear()


FLIES = {
    **dict.fromkeys((*names.READ, *names.LOCAL_PLACE), 0.0),
    names.HEIGHT: 1500.0,
    doctor_names.VERSION: 115501.0,
}


def flown_here(xplane, home, monkeypatch, *ids):
    """The card in this process, with little patience; its exit code and what it has written."""
    for name, short_s in (("_SEEN_S", 0.5), ("_LOAD_S", 0.5), ("_PAUSE_S", 0.3)):
        monkeypatch.setattr(flight, name, short_s)
    code = conformance.main(Settings("127.0.0.1", xplane.port, environment={"ROS_HOME": str(home)}), ids, True)
    file = results.file_of(home / "xplane_bridge", "127.0.0.1", xplane.port)
    return code, json.loads(file.read_text(encoding="utf-8"))["questions"].keys()


def test_answers_are_written_where_the_flight_cannot_be_put_back(tmp_path, monkeypatch, capsys):
    def begin(self):
        self._saved = True

    monkeypatch.setattr(flight.Flight, "begin", begin)
    with Silenced(FLIES) as xplane:
        assert flown_here(xplane, tmp_path, monkeypatch, "side-sign") == (1, {"side-sign"})
        sent = [protocol.decode_request(datagram) for datagram in xplane.others]
    # It may load for longer yet: what does not answer is not paused for that.
    assert sent == [protocol.Situation(protocol.Situation.LOAD, flight._SITUATION)]
    assert "not put back: the aircraft is not back where it was" in capsys.readouterr().err


def test_answers_are_written_where_the_aircraft_cannot_be_brought_into_the_air(tmp_path, monkeypatch, capsys):
    with FakeXPlane(FLIES) as xplane:
        flown = flown_here(xplane, tmp_path, monkeypatch, "same-index", "prel", "side-sign")
    assert flown == (2, {"same-index"})
    assert "X-Plane follows neither PREL nor VEHS nor local coordinates" in capsys.readouterr().err


def test_answers_are_written_where_the_card_is_ended_by_ctrl_c(tmp_path, monkeypatch, capsys):
    def interrupted(_self):
        raise KeyboardInterrupt

    monkeypatch.setattr(flight.Flight, "begin", interrupted)
    with FakeXPlane(FLIES) as xplane:
        flown = flown_here(xplane, tmp_path, monkeypatch, "same-index", "side-sign")
    assert flown == (2, {"same-index"})
    assert "ended by Ctrl-C: the questions after these were not asked" in capsys.readouterr().err
