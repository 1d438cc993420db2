"""The doctor's notes in the bridge's journal, beside nodes that hang and values that cannot be noted."""

from __future__ import annotations

import fcntl
import json
import math
import os
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from support.deadlines import WAIT_S
from support.simulator.fake_xplane import FakeXPlane
from xplane_bridge import protocol
from xplane_bridge.doctor.conformance import journal, link
from xplane_bridge.doctor.conformance.journal import Journal, JournalError, write_dataref
from xplane_bridge.doctor.observe.journals import boot_id, process_status
from xplane_bridge.harness import wait_until

ALTITUDE = write_dataref("sim/cockpit2/autopilot/altitude_dial_ft", 3000.0)
STICK, WIND, GUST = (
    "sim/operation/override/override_joystick_roll",
    "sim/weather/wind_speed_kt[0]",
    "sim/weather/shear_speed_kt[0]",
)
THROTTLES, LEVER = "sim/operation/override/override_throttles", "sim/cockpit2/engine/actuators/throttle_ratio[0]"
PROC = Path("/proc")


@pytest.fixture(name="notes")
def fixture_notes(tmp_path):
    return Journal(tmp_path, "127.0.0.1", 49000)


def test_it_is_read_where_a_hung_node_has_the_lock_and_not_written(notes, monkeypatch):
    monkeypatch.setattr(journal, "_LOCK_TIMEOUT_S", 0.1)
    notes.record("a", journal.OVERRIDE, [ALTITUDE])
    with open(f"{notes.file}.lock", "a", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert [entry["id"] for entry in notes.own()] == ["a"]
        with pytest.raises(JournalError, match="another process has it locked"):
            notes.record("b", journal.OVERRIDE, [ALTITUDE])
    notes.record("b", journal.OVERRIDE, [ALTITUDE])
    assert [entry["id"] for entry in notes.own()] == ["a", "b"]


def test_a_value_that_is_no_number_is_refused_and_the_rest_stays_readable(notes):
    notes.record("a", journal.OVERRIDE, [ALTITUDE])
    with pytest.raises(JournalError, match="no number cannot be noted"):
        notes.record("b", journal.OVERRIDE, [write_dataref("sim/a", math.nan)])
    assert [entry["id"] for entry in notes.own()] == ["a"]


def test_its_owner_is_seen_from_other_containers_until_it_ends(notes):
    show = (
        "import os, sys; from pathlib import Path; from xplane_bridge.doctor.conformance import journal;"
        "journal.Journal(Path(sys.argv[1]), '127.0.0.1', 49000).record('a', 'override', []); print(flush=True); input()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", show, str(notes.file.parent)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as owner:
        owner.stdout.readline()
        (left,) = journal.load(notes.file)
        assert is_byte_locked(notes.file.parent, left["owner"])
        owner.kill()
    assert not is_byte_locked(notes.file.parent, left["owner"])
    assert [entry["id"] for entry in notes.orphans()] == ["a"]


def is_byte_locked(folder, owner):
    """Whether an owner has its byte locked, as docs/nodes/journal.md has it."""
    start = owner["start_ticks"] * 4194304 + owner["pid"]
    byte = struct.pack("@hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, start, 1, 0)
    with open(folder / "owners.lock", "rb") as file:
        found = fcntl.fcntl(file, 36, byte)  # F_OFD_GETLK, which Python names from 3.9 on
    return struct.unpack("@hhqqi4x", found)[0] != fcntl.F_UNLCK


def entry(id_, pid, *undo, purpose="override"):
    ticks = process_status(PROC, str(pid))[1] if pid else 1
    owner = {"node": "/xplane/tx_node", "pid": pid or 2**22 + 1, "start_ticks": ticks}
    owner.update(boot_id=boot_id(PROC), computer=socket.gethostname())
    return {"id": id_, "purpose": purpose, "owner": owner, "undo": list(undo)}


def write(file, *entries):
    file.write_text(json.dumps({"format": "xplane_bridge journal", "version": 1, "entries": entries}), "utf-8")
    return file


@pytest.mark.parametrize(
    ("noted", "address", "also", "is_held"),
    [
        ("127.0.0.1_49000", "198.51.100.7", (), True),
        ("198.51.100.7_49000", "127.0.0.1", (), True),
        ("198.51.100.8_49000", "198.51.100.7", (), True),
        ("192.0.2.1_49000", "192.0.2.1", (), True),
        ("192.0.2.2_49000", "192.0.2.1", ("192.0.2.2",), True),
        ("192.0.2.2_49000", "192.0.2.1", (), False),
        ("127.0.0.1_49000", "192.0.2.1", (), False),
        ("127.0.0.1_49010", "127.0.0.1", (), False),
        ("127.0.0.1_49000_subscriptions", "127.0.0.1", (), False),
    ],
)
def test_who_calls_the_same_x_plane_by_another_address_holds_it(tmp_path, monkeypatch, noted, address, also, is_held):
    own = ("127.", "198.51.100.")
    monkeypatch.setattr("xplane_bridge.doctor.observe.computer.is_own", lambda address: address.startswith(own))
    file = write(tmp_path / f"{noted}.json", entry("override:x", os.getppid()), entry("override:y", 0))
    said = f"/xplane/tx_node (process {os.getppid()} on {socket.gethostname()}) holds {file}"
    assert Journal(tmp_path, address, 49000, also=also).holders() == ([said] if is_held else [])


def test_an_x_plane_of_this_computer_has_one_file_as_the_nodes_name_it(tmp_path, monkeypatch):
    own = ("127.", "198.51.100.")
    monkeypatch.setattr("xplane_bridge.doctor.observe.computer.is_own", lambda address: address.startswith(own))
    addresses = ("127.0.0.1", "127.0.0.2", "198.51.100.7", "192.0.2.1")
    names = [Journal(tmp_path, address, 49000).file.name for address in addresses]
    assert names == [*["127.0.0.1_49000.json"] * 3, "192.0.2.1_49000.json"]


def test_a_journal_of_another_address_that_cannot_be_understood_is_said(notes):
    file = notes.file.with_name("127.0.0.2_49000.json")
    file.write_text("{", "utf-8")
    with pytest.raises(JournalError, match=rf"^{file} cannot be understood"):
        notes.holders()


def test_what_was_left_under_another_address_is_undone_and_taken_out_of_its_file(tmp_path):
    id_ = f"override:{STICK}"
    with FakeXPlane({STICK: 1.0}) as xplane:
        notes = Journal(tmp_path, "127.0.0.1", xplane.port)
        notes.record(id_, journal.OVERRIDE, [write_dataref(STICK, 0.0)])
        earlier = tmp_path / f"127.0.0.2_{xplane.port}.json"
        write(earlier, entry(id_, 0, write_dataref(STICK, 0.0)), entry("override:x", os.getppid()))
        to = link.XPlane("127.0.0.1", xplane.port, notes)
        assert to.undo(notes.orphans()) == []
        to.close()
        assert written(xplane) == [(STICK, 0.0)]
    assert [each["id"] for each in journal.load(earlier)] == ["override:x"]
    assert [each["id"] for each in notes.own()] == [id_]


def unconfirmed(path, value):
    return {**write_dataref(path, value), "confirm": False}


def written(xplane):
    requests = [protocol.decode_request(datagram) for datagram in xplane.others]
    return [(request.path, request.value) for request in requests]


@pytest.mark.parametrize(
    ("shown", "sent"),
    [
        ({THROTTLES: 1.0}, [(LEVER, 0.5), (THROTTLES, 0.0)]),
        ({THROTTLES: 0.0}, [(THROTTLES, 0.0)]),  # a restarted X-Plane, whose engines are off
    ],
)
def test_levers_are_given_back_once_and_not_to_a_flight_that_has_its_own(tmp_path, monkeypatch, shown, sent):
    monkeypatch.setattr(link, "_UNCONFIRMED_AGAIN_S", 0.0)
    with FakeXPlane(shown) as xplane:
        notes = Journal(tmp_path, "127.0.0.1", xplane.port)
        write(notes.file, entry(f"override:{THROTTLES}", 0, unconfirmed(LEVER, 0.5), write_dataref(THROTTLES, 0.0)))
        to = link.XPlane("127.0.0.1", xplane.port, notes)
        assert to.undo(notes.orphans()) == []
        to.write(STICK, 0.0)  # behind it nothing is under way
        to.close()
        wait_until(lambda: (STICK, 0.0) in written(xplane), WAIT_S, "the last write")
        assert written(xplane) == [*sent, (STICK, 0.0)]
    assert not notes.file.exists()


def test_entries_of_which_x_plane_confirms_nothing_are_written_twice_and_taken_out(tmp_path, monkeypatch):
    first = [(STICK, 0.0), (WIND, 4.0), (GUST, 1.0), (WIND, 3.0)]
    waits, looked_at = [], []
    with FakeXPlane({}) as xplane:
        notes = Journal(tmp_path, "127.0.0.1", xplane.port)
        write(
            notes.file,
            entry("disturbance:wind", 0, unconfirmed(GUST, 1.0), unconfirmed(WIND, 3.0)),
            entry(f"override:{STICK}", 0, write_dataref(STICK, 0.0), unconfirmed(WIND, 4.0)),
        )

        def sleep(seconds):
            wait_until(lambda: written(xplane) == first, WAIT_S, "the first writes")
            waits.append((seconds, notes.file.exists()))

        def shows(_, wanted):  # the stick alone: the wind is another by then
            looked_at.append(wanted)
            return wanted == {STICK: 0.0}

        monkeypatch.setattr(link, "time", SimpleNamespace(monotonic=time.monotonic, sleep=sleep))
        monkeypatch.setattr(link.XPlane, "_shows", shows)
        to = link.XPlane("127.0.0.1", xplane.port, notes)
        assert to.undo(notes.orphans()) == []
        to.close()
        again = [(GUST, 1.0), (WIND, 3.0)]
        wait_until(lambda: written(xplane) == first + again, WAIT_S, "the second writes")
    assert waits == [(1.0, True)]
    assert looked_at == [{STICK: 0.0}]
    assert not notes.file.exists()
