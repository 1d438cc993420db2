"""What comes of a card: which file it is written to, and what of an earlier card stays in it."""

from __future__ import annotations

import json
import os

import pytest

from xplane_bridge.doctor.conformance import results
from xplane_bridge.doctor.conformance.card import Flown
from xplane_bridge.doctor.conformance.verdict import Answer, Verdict

HERE, ETHERNET, ELSEWHERE, PORT = "127.0.0.1", "198.51.100.7", "192.0.2.1", 49000
CONFIRMED, REFUTED, NOT_TESTABLE = Verdict.CONFIRMED, Verdict.REFUTED, Verdict.NOT_TESTABLE


@pytest.fixture(name="own", autouse=True)
def fixture_own(monkeypatch):
    own = ("127.", ETHERNET)
    monkeypatch.setattr("xplane_bridge.doctor.observe.computer.is_own", lambda address: address.startswith(own))


def flown(verdict, text="1 deg/s", id_="row16", version=122015):
    return Flown(version, {id_: Answer(verdict, text)}, ())


def store(folder, card, address=HERE):
    """The questions of the file, and the report, after a card."""
    file = results.file_of(folder, address, PORT)
    report = results.store(file, card, address, PORT)
    return json.loads(file.read_text("utf-8"))["questions"], report.read_text("utf-8")


@pytest.mark.parametrize("settled", [CONFIRMED, REFUTED])
def test_a_verdict_stays_where_a_later_card_cannot_test_it(tmp_path, settled):
    store(tmp_path, flown(settled))
    kept, report = store(tmp_path, flown(NOT_TESTABLE, "one engine"))
    assert kept == {
        "row16": {"verdict": settled.value, "text": "1 deg/s", "facts": {}, "later_not_testable": "one engine"}
    }
    assert f"row16: {settled.value}\n" in report
    assert "  later not testable: one engine\n" in report


@pytest.mark.parametrize(
    ("earlier", "later"),
    [
        (flown(REFUTED), flown(CONFIRMED, "0 deg/s")),
        (flown(NOT_TESTABLE), flown(REFUTED, "0 deg/s")),
        (flown(NOT_TESTABLE), flown(NOT_TESTABLE, "0 deg/s")),
        (flown(REFUTED, version=122014), flown(NOT_TESTABLE, "0 deg/s")),
    ],
)
def test_else_the_last_answer_for_this_version_counts(tmp_path, earlier, later):
    store(tmp_path, earlier)
    said = {"verdict": later.answers["row16"].verdict.value, "text": "0 deg/s", "facts": {}}
    assert store(tmp_path, later)[0] == {"row16": said}


def test_a_verdict_that_is_given_again_has_no_older_reason_beside_it(tmp_path):
    for card in (flown(REFUTED), flown(NOT_TESTABLE), flown(REFUTED)):
        kept, _ = store(tmp_path, card)
    assert kept == {"row16": {"verdict": "refuted", "text": "1 deg/s", "facts": {}}}


def test_the_x_plane_of_this_computer_has_one_file_whichever_address_it_is_called_by(tmp_path):
    assert [results.file_of(tmp_path, address, PORT).name for address in (HERE, "127.0.1.1", ETHERNET, ELSEWHERE)] == [
        *["127.0.0.1_49000_conformance.yaml"] * 3,
        "192.0.2.1_49000_conformance.yaml",
    ]


def test_a_card_of_an_earlier_doctor_under_another_address_of_this_computer_is_taken_over(tmp_path):
    older = tmp_path / f"{ETHERNET}_{PORT}_conformance.yaml"
    results.store(older, flown(REFUTED), ETHERNET, PORT)
    assert store(tmp_path, flown(CONFIRMED, id_="vehs"), ETHERNET)[0].keys() == {"row16", "vehs"}
    written = results.file_of(tmp_path, ETHERNET, PORT).stat().st_mtime
    for later_s, verdict in ((-60.0, "confirmed"), (60.0, "refuted")):
        results.store(older, flown(REFUTED, id_="vehs"), ETHERNET, PORT)
        os.utime(older, (written + later_s, written + later_s))
        assert store(tmp_path, flown(CONFIRMED, id_="prel"), ETHERNET)[0]["vehs"]["verdict"] == verdict
