"""The doctor's notes in the bridge's journal, beside nodes that hang and values that cannot be noted."""

from __future__ import annotations

import fcntl
import math

import pytest

from xplane_bridge.doctor.conformance import journal
from xplane_bridge.doctor.conformance.journal import Journal, JournalError, write_dataref

ALTITUDE = write_dataref("sim/cockpit2/autopilot/altitude_dial_ft", 3000.0)


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
