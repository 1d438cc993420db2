"""Tables hold nothing that was not flown, and lists so that every program can read them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import pyarrow.parquet
import pytest

from support.flights.export_flight import export
from support.flights.synthetic_flight import FlightBag, record_a_clock_set_back, stamp_ns

if TYPE_CHECKING:
    from pathlib import Path


def test_a_time_base_does_not_bridge_a_new_origin(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "flight.bag") as bag:
        for k in range(10):
            place = {"position_epoch": 1, "position_north": 0.0} if k < 5 else {"position_epoch": 2}
            values = {**bag.state(k / 10, k), "position_north": 5000.0, **place}
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / 10), values)
    assert export(tmp_path / "flight.bag", "--rate", "50", "-o", tmp_path) == 0
    table = pd.read_csv(tmp_path / "flight.csv")
    assert table["position_north_m"].tolist() == [0.0] * 21 + [5000.0] * 21


def test_a_time_base_lies_on_no_line_between_two_times_of_a_clock_set_back(tmp_path: Path) -> None:
    record_a_clock_set_back(tmp_path / "flight.bag", order_lost=True)
    assert export(tmp_path / "flight.bag", "--rate", "200", "-o", tmp_path) == 0
    table = pd.read_csv(tmp_path / "flight.csv")
    off = table["sim_time_unwrapped_s"] - table["time_s"]
    assert set(off.round(6)) == {0.0, 0.25}
    assert len(table) > 200


def test_commands_without_a_stamp_come_when_they_were_received(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "flight.bag") as bag:
        for k in range(10):
            ns = stamp_ns(k / 10)
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", ns, bag.state(k / 10, k))
            # As rospy sends a command whose header nothing fills.
            command = {"fields": 1, "roll": np.float32(k / 16)}
            bag.add("/xplane/control/auto", "xplane_bridge/ControlCommand", ns + 1_000_000, command)
    assert export(tmp_path / "flight.bag", "--topics", "control/auto", "-o", tmp_path) == 0
    rolls = pd.read_csv(tmp_path / "flight.csv")["control_auto_roll"]
    assert np.isnan(rolls[0])
    assert rolls[1:].tolist() == [k / 16 for k in range(9)]
    assert export(tmp_path / "flight.bag", "--format", "npz", "-o", tmp_path) == 0
    arrays = np.load(tmp_path / "flight.npz")
    expected = np.arange(10) / 10 + 0.001
    np.testing.assert_allclose(arrays["control_auto/time_s"], expected, atol=1e-9)
    np.testing.assert_allclose(arrays["control_auto/sim_time_unwrapped_s"], [*expected[:9], np.nan], atol=1e-9)


@pytest.mark.parametrize("form", ["csv", "parquet", "npz"])
def test_durations_are_seconds(tmp_path: Path, form: str) -> None:
    with FlightBag(tmp_path / "flight.bag") as bag:
        bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(1.0), bag.state(1.0, 0))
        applied = {"header": bag.header(stamp_ns(0.5), ""), "source_age": {"sec": 0, "nanosec": 31_250_000}}
        bag.add("/xplane/control/applied", "xplane_bridge/AppliedCommand", stamp_ns(0.5), applied)
    assert export(tmp_path / "flight.bag", "--format", form, "--topics", "control/applied", "-o", tmp_path) == 0
    if form == "npz":
        arrays = np.load(tmp_path / "flight.npz")
        assert arrays["control_applied/source_age_s"].tolist() == [0.03125]
        assert dict(arrays["units"])["control_applied/source_age_s"] == "s"
    else:
        table = {"csv": pd.read_csv, "parquet": pd.read_parquet}[form](tmp_path / f"flight.{form}")
        assert table["control_applied_source_age_s"].tolist() == [0.03125]


def test_each_element_of_a_clock_has_its_own_unit(tmp_path: Path) -> None:
    with FlightBag(tmp_path / "flight.bag") as bag:
        bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(1.0), bag.state(1.0, 0))
        values = {"header": bag.header(stamp_ns(0.5), ""), "clock_zulu": [12, 30, 4], "airspeed": [50, 51]}
        bag.add("/xplane/mission/instruments", "xplane_bridge/InstrumentState", stamp_ns(0.5), values)
    topic = ("--topics", "mission/instruments")
    assert export(tmp_path / "flight.bag", *topic, "-o", tmp_path) == 0
    (row,) = pd.read_csv(tmp_path / "flight.csv").to_dict("records")
    assert [row[f"mission_instruments_clock_zulu_{unit}"] for unit in ("h", "min", "s")] == [12, 30, 4]
    assert [row[f"mission_instruments_airspeed_{k}_mps"] for k in (0, 1)] == [50, 51]
    assert export(tmp_path / "flight.bag", "--format", "npz", *topic, "-o", tmp_path) == 0
    arrays = np.load(tmp_path / "flight.npz")
    assert arrays["mission_instruments/clock_zulu"].tolist() == [[12, 30, 4]]
    assert dict(arrays["units"])["mission_instruments/clock_zulu"] == "h, min, s"


LISTS = ("--topics", "events", "failures/state")


def write_lists(path: Path, *failures: int) -> Path:
    """As many failures and events as given at each second; flight states before them, too."""
    with FlightBag(path) as bag:
        for k in range(10 * len(failures)):
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / 10), bag.state(k / 10, k))
        for k, count in enumerate(failures):
            ns, names = stamp_ns(k + 0.5), [f"engine_{number}" for number in range(count)]
            lists = {"names": names, "values": [float("nan")] * count, "active": [True] * count}
            header = bag.header(ns, "")
            bag.add("/xplane/failures/state", "xplane_bridge/FailureState", ns, {"header": header, **lists})
            events = [{"number": number, "text": name} for number, name in enumerate(names)]
            bag.add("/xplane/events", "xplane_bridge/EventList", ns, {"header": header, "events": events})
    return path


def test_lists_are_json_in_csv(tmp_path: Path) -> None:
    assert export(write_lists(tmp_path / "flight.bag", 1, 2), *LISTS, "-o", tmp_path) == 0
    table = pd.read_csv(tmp_path / "flight.csv")
    assert table["events_events"].isna().tolist() == [True] * 5 + [False] * 15
    assert [event["text"] for event in json.loads(table["events_events"].iloc[-1])] == ["engine_0", "engine_1"]
    assert json.loads(table["failures_state_names"].iloc[5]) == ["engine_0"]
    assert json.loads(table["failures_state_values"].iloc[-1]) == [None, None]
    assert json.loads(table["failures_state_active"].iloc[-1]) == [True, True]


@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_columns_of_lists_are_the_same_in_every_flight(tmp_path: Path, form: str) -> None:
    found = set()
    for name, counts in (("none", (0, 0)), ("always", (1, 1)), ("comes", (0, 2))):
        bag = write_lists(tmp_path / f"{name}.bag", *counts)
        assert export(bag, "--format", form, *LISTS, "-o", tmp_path) == 0
        path = tmp_path / f"{name}.{form}"
        if form == "csv":
            found.add(tuple(pd.read_csv(path).columns))
        else:
            found.add(str(pyarrow.parquet.read_schema(path).remove_metadata()))
    assert len(found) == 1


def test_types_of_what_may_be_missing_are_the_same_in_every_flight(tmp_path: Path) -> None:
    files = []
    # Labels and further topics: none, from the middle on, and from the beginning on.
    for name, first in (("none", 99.0), ("comes", 0.5), ("always", -0.01)):
        with FlightBag(tmp_path / f"{name}.bag") as bag:
            for k in range(50):
                bag.add("/xplane/flight_state", "xplane_bridge/FlightState", stamp_ns(k / 50), bag.state(k / 50, k))
            ns = stamp_ns(first)
            link = {"header": bag.header(ns, ""), "link_epoch": 2, "host": "127.0.0.1"}
            bag.add("/xplane/link_state", "xplane_bridge/LinkState", ns, link)
            if name != "none":
                header = {"header": bag.header(ns, "")}
                bag.add("/xplane/control/mode", "xplane_bridge/ControlMode", ns, {**header, "mode": 2})
                bag.add("/xplane/failures/state", "xplane_bridge/FailureState", ns, header)
                bag.add("/xplane/excitation/state", "xplane_bridge/ExcitationState", ns, header)
        assert export(tmp_path / f"{name}.bag", "--format", "parquet", "--topics", "link_state", "-o", tmp_path) == 0
        files.append(tmp_path / f"{name}.parquet")
    schemas = [pyarrow.parquet.read_schema(file).remove_metadata() for file in files]
    assert schemas[0].equals(schemas[1])
    assert schemas[1].equals(schemas[2])
    types = {name: str(schemas[0].field(name).type) for name in ("mode", "failsafe", "link_state_link_epoch")}
    assert types == {"mode": "uint8", "failsafe": "bool", "link_state_link_epoch": "uint32"}
    table = pyarrow.parquet.read_table(files).to_pandas()
    assert table["mode"].isna().tolist() == [True] * 75 + [False] * 75
