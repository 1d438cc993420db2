"""What a recording says of how it was made."""

from __future__ import annotations

import json
import re

import pytest

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.bags import BagError, Bags
from xplane_bridge.bags.passport import read_passports, shortened
from xplane_bridge.cli.flights.rerun_flight import changes
from xplane_bridge.plotting.passports import differences_table, passport_section

PARAMETERS = {
    "aircraft": "fixed_wing",
    "experiment": {"flight": {"scenario": "demo", "options": ["--seed=3"]}, "aircraft_file": "a:\nb\n"},
    "rx_node": {"publish_tf": False, "rates": {}},
}


def add(bag, t, **fields):
    values = {
        "package_version": "0.2.0",
        "commit": "abc",
        "parameters": json.dumps(PARAMETERS),
        "xplane_version": 122015,
        "settings": ["sim/time/sim_speed", "sim/time/use_system_time"],
        "setting_values": [1.0, float("nan")],
        "refuted": ["row16"],
        **fields,
    }
    bag.add("/xplane/experiment", "xplane_bridge/Experiment", stamp_ns(t), values)


def passports(tmp_path, *messages):
    path = tmp_path / f"{len(list(tmp_path.iterdir()))}.bag"
    with FlightBag(path) as bag:
        bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(0), bag.state(0.0, 0))
        for t, fields in enumerate(messages):
            add(bag, t, **fields)
    with Bags(path) as bags:
        return read_passports(bags)


def test_it_is_read_with_parameters_as_paths(tmp_path):
    (found,) = passports(tmp_path, {})
    assert found.flight == {"scenario": "demo", "options": ["--seed=3"]}
    lines = found.lines()
    assert lines["X-Plane"] == "122015"
    assert lines["refuted assumptions"] == "row16"
    assert (lines["sim/time/sim_speed"], lines["sim/time/use_system_time"]) == ("1", "not known")
    assert (lines["aircraft"], lines["rx_node/publish_tf"], lines["rx_node/rates"]) == ("fixed_wing", "no", "{}")
    assert lines["experiment/aircraft_file"] == "a:\nb\n"
    assert "<td>a:<br>b<br></td>" in passport_section([found])


def test_a_repeated_one_counts_once_and_a_change_is_shown(tmp_path):
    found = passports(tmp_path, {}, {}, {"xplane_version": 121000})
    assert [p.others["X-Plane"] for p in found] == [122015, 121000]
    page = passport_section(found)
    assert "Changed in flight" in page
    assert "122015" in page.split("Changed in flight")[1]


def test_what_differs_is_a_row_and_nothing_else(tmp_path):
    (first,) = passports(tmp_path, {})
    (second,) = passports(tmp_path, {"commit": "<def>"})
    table = differences_table(["a.bag", "b.bag"], [first, second])
    assert table.count("<tr>") == 2
    assert "&lt;def&gt;" in table
    assert "Nothing" in differences_table(["a.bag", "b.bag"], [first, first])
    assert "none" in differences_table(["a.bag", "b.bag"], [first, None])


def flown(tmp_path, **experiment):
    (found,) = passports(tmp_path, {"parameters": json.dumps({"experiment": experiment})})
    return found


def test_a_file_that_differs_is_a_row_with_its_first_line_that_does(tmp_path):
    scenario = "name: s\nevents:\n- {at: 1, stick: {roll: %s}}\n"
    flights = [flown(tmp_path, flight={"text": scenario % roll}) for roll in (0.1, 0.3)]
    table = differences_table(["a.bag", "b.bag"], flights)
    assert "line 3: - {at: 1, stick: {roll: 0.1}} (SHA-256 " in table
    assert "line 3: - {at: 1, stick: {roll: 0.3}} (SHA-256 " in table
    assert table.count("<tr>") == 2
    (change,) = changes(*flights)
    assert change.startswith("experiment/flight/text: line 3: - {at: 1, stick: {roll: 0.1}} (SHA-256 ")
    assert "Changed in flight" in passport_section(flights)


@pytest.mark.parametrize(
    ("texts", "shown"),
    [
        (["Kim", None], ["Kim", None]),
        (["Kim", "Kim\nthird day"], ["Kim", "line 2: third day (SHA-256 )"]),
        (["a\nb", "a\nb\n"], ["ends before line 3 (SHA-256 )", "line 3:  (SHA-256 )"]),
        (["a\nb", None, "a\nb"], ["line 1: a (SHA-256 )", None, "line 1: a (SHA-256 )"]),
        (
            ["x" * 200 + "1" + "y" * 200, "x" * 200 + "2"],
            ["\u2026 " + "x" * 40 + "1" + "y" * 119 + " \u2026 (SHA-256 )", "\u2026 " + "x" * 40 + "2 (SHA-256 )"],
        ),
    ],
)
def test_long_texts_are_shown_from_where_they_differ(texts, shown):
    found = shortened(texts)
    without = [re.sub("SHA-256 [0-9a-f]{8}", "SHA-256 ", text) if text is not None else None for text in found]
    assert without == shown


def test_texts_that_differ_never_look_alike():
    rows = ["z" + "x" * 300, "x" * 300 + "1", "x" * 300 + "2", "x" * 300, "x" * 100 + "\n", "x" * 100]
    assert len(set(shortened(rows))) == len(rows)


def test_numbers_that_differ_in_a_late_digit_differ_everywhere(tmp_path):
    flights = [flown(tmp_path, origin=longitude) for longitude in (126.44071, 126.44074)]
    assert changes(*flights) == ["experiment/origin: 126.44071 -> 126.44074"]
    assert "126.44074" in differences_table(["a.bag", "b.bag"], flights)
    (first,) = passports(tmp_path, {"setting_values": [1e6 + 0.1, 0.1]})
    (second,) = passports(tmp_path, {"setting_values": [1e6 + 0.2, 0.1]})  # as float32: by 2 of its last digit
    assert first.lines()["sim/time/use_system_time"] == "0.1"
    assert changes(first, second) == ["sim/time/sim_speed: 1000000.1 -> 1000000.2"]


def test_a_recording_without_one_says_so(tmp_path):
    assert passports(tmp_path) == []
    assert "no topic experiment" in passport_section([])
    assert "no topic experiment" in differences_table(["a", "b"], [None, None])


def test_parameters_that_are_no_json_are_an_error(tmp_path):
    with pytest.raises(BagError, match="/xplane/experiment: the parameters are no JSON"):
        passports(tmp_path, {"parameters": "{"})
