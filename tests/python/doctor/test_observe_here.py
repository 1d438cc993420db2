"""What the doctor observes on this computer: journals, ROS, windows, joysticks, clock."""

import fcntl
import json
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

import pytest

from xplane_bridge.doctor.observe import clock, journals, joysticks, ros, windows
from xplane_bridge.doctor.observe.journals import Owner
from xplane_bridge.doctor.settings import Settings
from xplane_bridge.harness import wait_until
from xplane_bridge.harness.display import VirtualDisplay

#: Python names it from 3.9 on.
F_OFD_SETLK = 37

# --------------------------------------------------------------------------------------------------------- journals


def start_ticks(pid):
    stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii")
    return int(stat.rpartition(")")[2].split()[19])


def owner_of(pid, ticks, boot_id=None, computer=None):
    here = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    return {
        "node": "/xplane/tx_node",
        "pid": pid,
        "start_ticks": ticks,
        "boot_id": boot_id or here,
        "computer": computer or socket.gethostname(),
    }


def write_journal(folder, *owners, name="192.0.2.1_49000.json"):
    path = "sim/operation/override/override_joystick"
    entries = [
        {
            "id": f"override:{path}",
            "purpose": "override",
            "owner": owner,
            "undo": [{"op": "dref", "path": path, "value": 0.0}],
        }
        for owner in owners
    ]
    journal = {"format": "xplane_bridge journal", "version": 1, "entries": entries}
    (folder / name).write_text(json.dumps(journal), encoding="utf-8")


@pytest.fixture
def sleeper():
    with subprocess.Popen(["sleep", "60"]) as process:
        yield process
        process.kill()


def owner_in(folder):
    (journal,) = journals.read(folder)
    assert (journal.host, journal.port, journal.error) == ("192.0.2.1", 49000, "")
    (found,) = journal.entries
    assert (found.purpose, found.node) == ("override", "/xplane/tx_node")
    return found.owner


def test_an_owner_that_runs_is_stopped_and_ends(tmp_path, sleeper):
    write_journal(tmp_path, owner_of(sleeper.pid, start_ticks(sleeper.pid)))
    assert owner_in(tmp_path) is Owner.RUNS
    sleeper.send_signal(signal.SIGSTOP)
    wait_until(lambda: owner_in(tmp_path) is Owner.STOPPED, 15.0, "stopped owner")
    sleeper.kill()
    wait_until(lambda: owner_in(tmp_path) is Owner.GONE, 15.0, "end of the owner")  # a zombie until it is waited for


def test_another_process_with_the_same_number_is_not_the_owner(tmp_path, sleeper):
    write_journal(tmp_path, owner_of(sleeper.pid, start_ticks(sleeper.pid) - 1))
    assert owner_in(tmp_path) is Owner.GONE


def test_owners_before_a_reboot_and_on_other_computers(tmp_path):
    write_journal(tmp_path, owner_of(1, 1, boot_id="before"))
    assert owner_in(tmp_path) is Owner.GONE
    write_journal(tmp_path, owner_of(1, 1, boot_id="theirs", computer="another"))
    assert owner_in(tmp_path) is Owner.ELSEWHERE


def test_an_owner_in_another_container_runs_while_it_has_its_byte_locked(tmp_path, sleeper):
    owner = owner_of(sleeper.pid, start_ticks(sleeper.pid) + 1)  # that number is another process's here
    write_journal(tmp_path, owner)
    with open(tmp_path / "owners.lock", "a+b") as locked:
        start = owner["start_ticks"] * 4194304 + owner["pid"]
        fcntl.fcntl(locked, F_OFD_SETLK, struct.pack("@hhqqi4x", fcntl.F_RDLCK, os.SEEK_SET, start, 1, 0))
        assert owner_in(tmp_path) is Owner.RUNS
        owner["pid"] += 1
        write_journal(tmp_path, owner)
        assert owner_in(tmp_path) is Owner.GONE
        owner["pid"] -= 1
        write_journal(tmp_path, owner)
    assert owner_in(tmp_path) is Owner.GONE


@pytest.mark.parametrize("text", ["{", "[]", '{"format": "xplane_bridge journal", "version": 2, "entries": []}', "{}"])
def test_what_is_no_journal_is_reported(text, tmp_path):
    (tmp_path / "192.0.2.1_49000.json").write_text(text, encoding="utf-8")
    (journal,) = journals.read(tmp_path)
    assert journal.error
    assert not journal.entries


def test_without_a_folder_there_is_no_journal(tmp_path):
    assert journals.read(tmp_path / "nothing") == ()
    (tmp_path / "notes.json").write_text("{}", encoding="utf-8")
    assert journals.read(tmp_path) == ()
    assert Settings(environment={"ROS_HOME": "/data/ros"}).journal_folder == Path("/data/ros/xplane_bridge")
    assert Settings(environment={}).journal_folder == Path.home() / ".ros" / "xplane_bridge"


# -------------------------------------------------------------------------------------------------------------- ROS


class Quiet(SimpleXMLRPCRequestHandler):
    def log_message(self, *_):
        """Nothing on the test's output."""


class FakeMaster:
    """What a ROS master answers, on a port of the loopback interface."""

    def __init__(self, nodes, parameters):
        self._nodes, self._parameters = nodes, parameters
        self._server = SimpleXMLRPCServer(("127.0.0.1", 0), Quiet, allow_none=True)
        self._server.register_instance(self)
        self.uri = f"http://127.0.0.1:{self._server.server_address[1]}"
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()

    def getPid(self, _caller):  # noqa: N802 - ROS's name
        return [1, "", 4711]

    def getParam(self, _caller, key):  # noqa: N802
        there = key == "/xplane" and self._parameters is not None
        return [1, "", self._parameters] if there else [-1, f"Parameter [{key}] is not set", 0]

    def getSystemState(self, _caller):  # noqa: N802
        topics = [["/xplane/flight_state", list(self._nodes)], ["/rosout", ["/rosout"]]]
        return [1, "", [topics, [], []]]

    def lookupNode(self, _caller, name):  # noqa: N802
        return [1, "", self._nodes[name]]


def test_a_master_its_parameters_and_nodes_are_seen():
    with socket.socket() as node, socket.socket() as gone:
        node.bind(("127.0.0.1", 0))
        node.listen()
        gone.bind(("127.0.0.1", 0))  # no program listens there
        uris = {
            "/xplane/rx_node": f"http://127.0.0.1:{node.getsockname()[1]}/",
            "/xplane/tx_node": f"http://127.0.0.1:{gone.getsockname()[1]}/",
            "/xplane/capture_node": "http://no-such-computer.invalid:4000/",
            "/other/rx_node": "http://127.0.0.1:1/",
        }
        with FakeMaster(uris, {"host": "192.0.2.1", "port": 49100}) as master:
            facts = ros.observe({"ROS_MASTER_URI": master.uri, "ROS_IP": "127.0.0.1"}, "/xplane/")
    assert facts.answered
    assert facts.here
    assert facts.parameters == {"host": "192.0.2.1", "port": 49100}
    found = {each.name: each.error for each in facts.nodes}
    assert found == {
        "/xplane/capture_node": "its name is not known on this computer",
        "/xplane/rx_node": "",
        "/xplane/tx_node": os.strerror(111),  # Connection refused
    }
    assert (facts.ip, facts.hostname) == ("127.0.0.1", "")


@pytest.mark.parametrize("namespace", ["xplane", "xplane/"])
def test_a_namespace_without_a_slash_is_found(namespace):
    with FakeMaster({"/xplane/rx_node": "http://127.0.0.1:1/"}, {"port": 49100}) as master:
        facts = ros.observe({"ROS_MASTER_URI": master.uri}, namespace)
    assert [each.name for each in facts.nodes] == ["/xplane/rx_node"]
    assert facts.parameters == {"port": 49100}


def test_a_master_without_the_bridge():
    with FakeMaster({}, None) as master:
        facts = ros.observe({"ROS_MASTER_URI": master.uri}, "/xplane")
    assert (facts.answered, facts.parameters, facts.nodes) == (True, {}, ())


@pytest.mark.parametrize("uri", ["localhost:11311", "http://localhost", "http://localhost:ros", "https://localhost:1"])
def test_a_uri_that_is_none(uri):
    facts = ros.observe({"ROS_MASTER_URI": uri}, "/xplane")
    assert facts.malformed
    assert not facts.answered


def test_masters_that_do_not_answer():
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))
        refused = ros.observe({"ROS_MASTER_URI": f"http://127.0.0.1:{bound.getsockname()[1]}"}, "/xplane")
        assert (refused.answered, refused.refused, refused.here) == (False, True, True)
        bound.listen()  # takes connections, and says nothing
        silent = ros.observe({"ROS_MASTER_URI": f"http://127.0.0.1:{bound.getsockname()[1]}"}, "/xplane")
        assert (silent.answered, silent.refused) == (False, False)
        assert "no answer within 2 s" in silent.error
    unknown = ros.observe({"ROS_MASTER_URI": "http://no-such-computer.invalid:11311"}, "/xplane")
    assert "no-such-computer.invalid is not known" in unknown.error


def test_something_else_on_the_masters_port():
    def answer(listener):
        with listener.accept()[0] as connection:
            connection.recv(4096)
            connection.sendall(b"SSH-2.0-OpenSSH_9.2\r\n")

    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        threading.Thread(target=answer, args=(listener,), daemon=True).start()
        facts = ros.observe({"ROS_MASTER_URI": f"http://127.0.0.1:{listener.getsockname()[1]}"}, "/xplane")
    assert "no ROS master" in facts.error


def test_names_of_this_computer():
    known = ros.observe({"ROS_HOSTNAME": "localhost"}, "/xplane")
    assert (known.hostname, known.hostname_address) == ("localhost", "127.0.0.1")
    unknown = ros.observe({"ROS_HOSTNAME": "no-such-computer.invalid"}, "/xplane")
    assert unknown.hostname_address == ""


# ---------------------------------------------------------------------------------------------------------- windows

#: Shows two windows by Tk: one with X-Plane's title, one without; says so when they are there.
TWO_WINDOWS = """
import tkinter
root = tkinter.Tk(); root.title("X-System"); root.geometry("320x240")
other = tkinter.Toplevel(root); other.title("Höhe"); other.geometry("200x100")
root.update(); other.update(); print("shown", flush=True); root.mainloop()
"""


@pytest.mark.skipif(shutil.which("Xvfb") is None, reason="there is no Xvfb (apt-get install xvfb)")
def test_windows_their_titles_sizes_and_programs_are_seen(tmp_path):
    pytest.importorskip("tkinter", reason="there is no tkinter (apt-get install python3-tk)")
    with VirtualDisplay(tmp_path) as display:
        env = {**os.environ, "DISPLAY": display.display}
        with subprocess.Popen([sys.executable, "-c", TWO_WINDOWS], env=env, stdout=subprocess.PIPE, text=True) as shown:
            assert shown.stdout.readline() == "shown\n"
            seen = windows.observe(display.display, lambda title: title == "X-System")
            shown.kill()
        assert not seen.error
        found = {each.title: each for each in seen.windows}
        assert {"X-System", "Höhe"} <= found.keys()
        assert (found["X-System"].width, found["X-System"].height, found["X-System"].shown) == (320, 240, True)
        assert found["X-System"].grab_s > 0
        assert found["Höhe"].grab_s is None, "only the wanted window's picture is read"
        assert windows.observe(display.display, lambda _: True).windows == ()
    assert windows.observe(display.display, lambda _: True).error
    assert windows.observe("", lambda _: True) == windows.Display()


# -------------------------------------------------------------------------------------------------------- joysticks

INPUT_DEVICES = """I: Bus=0003 Vendor=046d Product=c215 Version=0110
N: Name="Logitech Extreme 3D"
H: Handlers=event5 js0
B: PROP=0

I: Bus=0011 Vendor=0001 Product=0001 Version=ab41
N: Name="AT Translated Set 2 keyboard"
H: Handlers=sysrq kbd event0 leds
"""


def test_joysticks_are_listed_with_their_names(tmp_path, monkeypatch):
    devices, proc = tmp_path / "input", tmp_path / "proc"
    devices.mkdir()
    (proc / "bus" / "input").mkdir(parents=True)
    (proc / "bus" / "input" / "devices").write_text(INPUT_DEVICES, encoding="utf-8")
    for name in ("js0", "js1", "event0", "event5"):
        (devices / name).touch()
    event = str(devices / "event5")
    for event_readable in (True, False):  # to root every file is readable: the system's answer is given here
        monkeypatch.setattr(os, "access", lambda file, _mode, said=event_readable: str(file) != event or said)
        assert joysticks.observe(devices, proc).found == (
            joysticks.Joystick(str(devices / "js0"), "Logitech Extreme 3D", True, event, event_readable),
            joysticks.Joystick(str(devices / "js1"), "", True),
        )
    monkeypatch.undo()
    (devices / "event5").unlink()  # a container that was given js0 alone
    assert [each.event_readable for each in joysticks.observe(devices, proc).found] == [False, True]
    assert joysticks.observe(tmp_path / "nothing", tmp_path / "nothing") == joysticks.Joysticks((), supported=False)


# ------------------------------------------------------------------------------------------------------------ clock


class Clocks:
    """A system's clock and a steady one, moved by hand."""

    def __init__(self):
        self.steady = 1_000_000_000
        self.offset = 1_700_000_000_000_000_000
        self.interruption = 0

    def steady_ns(self):
        return self.steady

    def system_ns(self):
        self.steady += self.interruption
        return self.steady + self.offset


def watcher_of(clocks):
    """A watcher that looks when the test says, not by itself."""
    watcher = clock.ClockWatcher(clocks.system_ns, clocks.steady_ns)
    watcher._thread = threading.Thread(target=int)
    return watcher


def test_the_largest_step_counts_and_its_direction():
    clocks = Clocks()
    watcher = watcher_of(clocks)
    with watcher:
        for step_ns in (0, 20_000_000, -300_000_000, 50_000):
            clocks.offset += step_ns
            clocks.steady += 1_000_000_000
            watcher.look()
    assert watcher.result.step_s == pytest.approx(-0.3)
    assert watcher.result.watched_s == pytest.approx(4.0)


def test_an_interrupted_reading_is_no_step():
    clocks = Clocks()
    watcher = watcher_of(clocks)
    with watcher:
        watcher.look()
        clocks.interruption = 50_000_000  # a busy computer: 50 ms between two readings
        watcher.look()
        clocks.interruption = 0
        watcher.look()
    assert watcher.result.step_s == 0


def test_this_computers_clock_is_watched():
    with clock.ClockWatcher() as watcher:
        time.sleep(0.12)  # [s] to have something to watch
    assert watcher.result.watched_s >= 0.12
    assert watcher.result.synchronised in (True, False, None)
