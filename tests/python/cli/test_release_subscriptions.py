"""The panic tool and what nodes that are gone have left subscribed."""

from __future__ import annotations

import fcntl
import json
import selectors
import socket
import struct
import sys
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import pytest

from support.journals import NO_WAY, STICK, TOOL, asked, entry, ids, release, write
from xplane_bridge.harness.ports import free_udp_port


@pytest.fixture
def subscribed(tmp_path: Path) -> Path:
    """What a process that is gone has left subscribed."""
    left = entry(
        "subscriptions:/rx_node", subscriptions=[{"port": free_udp_port(), "datarefs": [STICK], "rpos": False}]
    )
    return write(tmp_path / f"127.0.0.1_{free_udp_port()}_subscriptions.json", left)


@pytest.fixture
def tool() -> ModuleType:
    """The tool in this process."""
    loader = SourceFileLoader("release_overrides", str(TOOL))
    module = ModuleType(loader.name)
    loader.exec_module(module)
    return module


def test_subscriptions_are_ended_as_soon_as_a_node_has_written_its_own(
    tool: ModuleType, subscribed: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    waits = []
    with open(f"{subscribed}.lock", "a", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)

        def sleep(seconds: float) -> None:
            waits.append(seconds)
            fcntl.flock(lock, fcntl.LOCK_UN)

        monkeypatch.setattr("time.sleep", sleep)
        monkeypatch.setattr(sys, "argv", [str(TOOL), "--folder", str(subscribed.parent)])
        assert tool.main() == 0
    assert len(waits) == 1
    assert ": ended" in capsys.readouterr().out
    assert not subscribed.exists()


def test_subscriptions_stay_where_a_node_was_stopped_while_it_wrote_them(subscribed: Path) -> None:
    with open(f"{subscribed}.lock", "a", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = release(subscribed)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(f"{subscribed}: a node is writing it, or was stopped while it did")
    assert ids(subscribed) == ["subscriptions:/rx_node"]


def of(computer: str) -> Dict[str, Any]:
    """What a process of a computer has left, at two ports."""
    left = asked("subscriptions:/rx_node", free_udp_port(), free_udp_port())
    return {**left, "owner": {**left["owner"], "computer": computer}}


def test_subscriptions_are_listed_and_stay(tmp_path: Path) -> None:
    here, elsewhere = of(socket.gethostname()), of("lab-pc-3")
    file = write(tmp_path / "127.0.0.1_49000_subscriptions.json", here, elsewhere)
    with open(f"{file}.lock", "a", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # to be read, it is not waited for
        done = release(file, "--list")
    line = "127.0.0.1:49000 4 subscriptions of /tx_node, process 1"
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == [line, f"{line}, on another computer"]
    assert json.loads(file.read_text("utf-8"))["entries"] == [here, elsewhere]


def test_where_nothing_is_done_that_is_said(tmp_path: Path) -> None:
    """Where a node runs, its port is in use."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as running:
        running.bind(("", 0))
        runs = asked("subscriptions:/rx_node", running.getsockname()[1])
        file = write(tmp_path / "127.0.0.1_49000_subscriptions.json", runs, of("lab-pc-3"))
        done = release(file)
    said = f"nothing to release: no entry of a process of this computer that is gone in {tmp_path}\n"
    assert (done.returncode, done.stdout, done.stderr) == (0, said, "")
    file.unlink()
    assert release(file).stdout == f"nothing to release: no journal in {tmp_path}\n"


def test_damaged_subscriptions_stay_and_the_others_end(tmp_path: Path) -> None:
    sound = entry(
        "subscriptions:/rx_node", subscriptions=[{"port": free_udp_port(), "datarefs": [STICK], "rpos": False}]
    )
    damaged = [
        entry("subscriptions:/a", subscriptions=[{"port": 99999, "datarefs": [], "rpos": False}]),
        entry("subscriptions:/b", subscriptions=[{"port": 4711, "datarefs": [7], "rpos": False}]),
        entry("subscriptions:/c", subscriptions=[{"datarefs": [], "rpos": False}]),
        entry("subscriptions:/d"),
    ]
    file = write(tmp_path / f"127.0.0.1_{free_udp_port()}_subscriptions.json", *damaged, sound)
    done = release(file)
    assert done.stderr == ""
    assert done.stdout.count("cannot be carried out") == 4
    assert json.loads(file.read_text("utf-8"))["entries"] == damaged


class Sending:
    """An X-Plane that sends what it was asked for; it has its turns while the tool listens.

    Args:
        ports: Where it sends a value, by index of the request.
        lost: So many requests do not arrive.
    """

    def __init__(self, ports: Dict[int, Sequence[int]], lost: int = 0) -> None:
        self.goes_on = {(port, index) for port, indices in ports.items() for index in indices}
        self.requests: List[Tuple[int, int]] = []
        self._lost = lost
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]

    def turn(self) -> None:
        """Sends, and then reads what it was asked."""
        for port, index in sorted(self.goes_on):
            self._socket.sendto(b"RREF," + struct.pack("<if", index, 1.0), ("127.0.0.1", port))
        while True:
            try:
                packet, (_, port) = self._socket.recvfrom(2048, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return
            rate, index = struct.unpack_from("<ii", packet, 5)
            assert (packet[:4], rate) == (b"RREF", 0)
            self.requests.append((port, index))
            if self._lost:
                self._lost -= 1
            else:
                self.goes_on.discard((port, index))


@pytest.fixture
def release_from(
    tool: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., Tuple[Optional[int], float]]:
    """Runs the tool while X-Planes have their turns; gives its exit code, and how long it took by their clock [s]."""
    now = [0.0]

    def run(*xplanes: Sending) -> Tuple[Optional[int], float]:
        class Turns(selectors.DefaultSelector):
            def select(self, timeout: Optional[float] = None) -> Any:
                if timeout:
                    for each in xplanes:
                        each.turn()
                    now[0] += min(timeout, 0.05)
                return super().select(0.0)

        monkeypatch.setattr("selectors.DefaultSelector", Turns)
        monkeypatch.setattr(sys, "argv", [str(TOOL), "--folder", str(tmp_path)])
        clock = SimpleNamespace(monotonic=lambda: now[0], sleep=lambda _: None)
        monkeypatch.setattr(tool, "time", clock)
        code = tool.main()
        for each in xplanes:
            each.turn()
        return code, now[0]

    return run


def test_subscriptions_of_which_a_request_is_lost_or_that_no_journal_has_are_ended(
    release_from: Callable[..., Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    port, quiet, read = free_udp_port(), free_udp_port(), 1063  # what was being read is in no journal
    xplane = Sending({port: (0, 1, read)}, lost=1)
    file = write(tmp_path / f"127.0.0.1_{xplane.port}_subscriptions.json", asked("s:/rx_node", port, quiet))
    code, took_s = release_from(xplane)
    assert xplane.goes_on == set()
    assert xplane.requests == [(port, 0), (port, 1), (quiet, 0), (quiet, 1), (port, 0), (port, 1), (port, read)]
    assert (code, file.exists()) == (0, False)
    assert took_s == pytest.approx(3.0)
    assert capsys.readouterr().out.endswith("4 subscriptions of /tx_node, process 1: ended\n")


def test_subscriptions_that_go_on_are_kept_and_said(
    release_from: Callable[..., Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    port, quiet = free_udp_port(), free_udp_port()
    xplane = Sending({port: (0,)}, lost=1000)
    file = write(
        tmp_path / f"127.0.0.1_{xplane.port}_subscriptions.json", asked("s:/rx_node", port), asked("s:/b", quiet)
    )
    assert release_from(xplane) == (1, pytest.approx(4.5))
    assert ids(file) == ["s:/rx_node"]
    assert xplane.requests.count((port, 0)) == 3
    said = capsys.readouterr().out
    assert said.count(": X-Plane goes on sending them; kept in the journal") == 1
    assert said.count(": ended") == 1


def test_all_entries_of_all_x_planes_are_listened_to_side_by_side(
    release_from: Callable[..., Any], tmp_path: Path
) -> None:
    ports = [free_udp_port() for _ in range(4)]
    first, second = Sending(dict.fromkeys(ports[:2], (0, 1))), Sending(dict.fromkeys(ports[2:], (0, 1)))
    # A process that is gone may have had the port of one that went before it.
    names = [asked(f"s:/{number}", *ports[:2]) for number in range(3)]
    write(tmp_path / f"127.0.0.1_{first.port}_subscriptions.json", *names)
    write(tmp_path / f"127.0.0.1_{second.port}_subscriptions.json", asked("s:/a", ports[2]), asked("s:/b", ports[3]))
    assert release_from(first, second) == (0, pytest.approx(1.5))
    assert first.goes_on == second.goes_on == set()
    assert len(first.requests) == 12
    assert list(tmp_path.glob("*.json")) == []


def test_nothing_is_listened_to_where_nothing_is_left_or_can_be_sent(
    release_from: Callable[..., Any], tmp_path: Path
) -> None:
    assert release_from() == (0, 0.0)
    xplane = Sending({})
    write(tmp_path / f"{NO_WAY}_49000_subscriptions.json", asked("s:/a", free_udp_port()))
    write(tmp_path / f"127.0.0.1_{xplane.port}_subscriptions.json", asked("s:/runs", xplane.port))
    assert release_from(xplane)[1] == 0.0
    assert len(list(tmp_path.glob("*.json"))) == 2
