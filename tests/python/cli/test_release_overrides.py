"""The panic tool where a node was stopped while it was writing the journal."""

from __future__ import annotations

import fcntl
import json
import socket
import struct
import subprocess
import sys
import threading
from pathlib import Path
from typing import Dict, Tuple

import pytest

TOOL = Path(__file__).resolve().parents[3] / "scripts" / "release_overrides"
FOLDER = "sim/operation/override/"
STICK, THROTTLES = FOLDER + "override_joystick_roll", FOLDER + "override_throttles"
TIMEOUT_S = 60.0


class XPlane:
    """Takes DREF, answers RREF once."""

    def __init__(self) -> None:
        self.values: Dict[str, float] = {STICK: 1.0, THROTTLES: 1.0}
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while True:
            packet, client = self._socket.recvfrom(2048)
            if packet[:4] == b"DREF":
                self.values[_path(packet[9:])] = struct.unpack_from("<f", packet, 5)[0]
            elif packet[:4] == b"RREF":
                rate, index = struct.unpack_from("<ii", packet, 5)
                if rate:
                    answer = struct.pack("<if", index, self.values[_path(packet[13:])])
                    self._socket.sendto(b"RREF," + answer, client)


def _path(text: bytes) -> str:
    return text.split(b"\0")[0].decode()


@pytest.fixture
def left(tmp_path: Path) -> Tuple[XPlane, Path]:
    """An X-Plane with two overrides, and the journal that has them."""
    xplane = XPlane()
    owner = {"node": "/tx_node", "pid": 1, "start_ticks": 1, "boot_id": "b", "computer": "pc"}
    entries = [
        {"id": "override:" + path, "purpose": "override", "owner": owner, "undo": [undo]}
        for path, undo in ((path, {"op": "dref", "path": path, "value": 0.0}) for path in (STICK, THROTTLES))
    ]
    journal = tmp_path / f"127.0.0.1_{xplane.port}.json"
    journal.write_text(json.dumps({"format": "xplane_bridge journal", "version": 1, "entries": entries}), "utf-8")
    return xplane, journal


def release(journal: Path, *more: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(TOOL), "--folder", str(journal.parent), *more]
    return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)


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
