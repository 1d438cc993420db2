"""Recordings as MCAP and as ROS 2 bags, read back with mcap's and rosbags' own readers."""

from __future__ import annotations

import sqlite3
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from support.flights.export_flight import export, picture, write_flight
from support.flights.synthetic_flight import FlightBag, record_a_clock_set_back, stamp_ns, state_at
from xplane_bridge.bags import Bags

OLD_BAG = Path(__file__).resolve().parents[3] / "tests/data/bags/every_topic_0.1.0.bag"
TIMES = np.arange(200) / 50.0 + (np.arange(200) >= 100)


def counts(bag: Path) -> dict:
    with Bags(bag) as bags:
        return {name: info.count for name, info in bags.topics.items() if info.count}


def test_mcap_has_every_message_as_recorded(tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    bag = write_flight(tmp_path / "flight.bag")
    assert export(bag, "--format", "mcap", "-o", tmp_path) == 0
    with (tmp_path / "flight.mcap").open("rb") as file:
        mcap = reader.make_reader(file)
        assert mcap.get_header().profile == "ros1"
        summary = mcap.get_summary()
        topics = {c.topic: summary.statistics.channel_message_counts[c.id] for c in summary.channels.values()}
        assert topics == counts(bag)
        schemas = {schema.name: schema for schema in summary.schemas.values()}
        assert schemas["xplane_bridge/FlightState"].encoding == "ros1msg"
        assert b"# [deg] -180..180, right wing down +" in schemas["xplane_bridge/FlightState"].data
        with Bags(bag) as bags:
            expected = [(source.topic, time, bytes(raw)) for source, time, raw in bags.recorded()]
        found = [(channel.topic, m.log_time, m.data) for _, channel, m in mcap.iter_messages()]
    assert sorted(found) == sorted(expected)
    assert [time for _, time, _ in found] == [time for _, time, _ in expected]


def test_mcap_says_what_is_latched(tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    assert export(OLD_BAG, "--format", "mcap", "-o", tmp_path) == 0
    with (tmp_path / f"{OLD_BAG.stem}.mcap").open("rb") as file:
        channels = reader.make_reader(file).get_summary().channels.values()
        latching = {channel.topic: channel.metadata["latching"] for channel in channels}
    assert set(latching.values()) == {"true", "false"}, "as the registry of MCAP has it"
    assert latching["/xplane/link_state"] == "true"
    assert latching["/xplane/flight_state"] == "false"


def test_mcap_decodes_with_its_ros1_reader(tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    decoder = pytest.importorskip("mcap_ros1.decoder", reason="mcap-ros1-support is not installed")
    assert export(write_flight(tmp_path / "flight.bag"), "--format", "mcap", "-o", tmp_path) == 0
    with (tmp_path / "flight.mcap").open("rb") as file:
        mcap = reader.make_reader(file, decoder_factories=[decoder.DecoderFactory()])
        states = [decoded for *_, decoded in mcap.iter_decoded_messages(topics=["/xplane/flight_state"])]
        image = next(decoded for *_, decoded in mcap.iter_decoded_messages(["/xplane/camera/image_raw/compressed"]))
    assert [state.roll_deg for state in states] == [state_at(t)["roll_deg"] for t in TIMES]
    assert [state.header.stamp.to_nsec() for state in states] == [stamp_ns(t) for t in TIMES]
    pixels = cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_COLOR)
    assert np.abs(pixels.astype(int) - picture(0).astype(int)).mean() < 3


def test_without_mcap_it_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    assert export(write_flight(tmp_path / "flight.bag", 0.2), "--format", "mcap", "-o", tmp_path) == 1
    assert "--format mcap needs the package mcap: pip install mcap" in capsys.readouterr().err


def test_a_ros2_bag_has_every_message(tmp_path: Path) -> None:
    bag = write_flight(tmp_path / "flight.bag")
    assert export(bag, "--format", "ros2", "-o", tmp_path) == 0
    folder = tmp_path / "flight.ros2"
    assert "flight.ros2.db3" in (folder / "metadata.yaml").read_text()
    with AnyReader([folder]) as reader:
        assert {c.topic: c.msgcount for c in reader.connections} == counts(bag)
        read = {
            topic: [
                (time, reader.deserialize(raw, c.msgtype))
                for c, time, raw in reader.messages([c for c in reader.connections if c.topic == topic])
            ]
            for topic in ("/xplane/flight_state", "/xplane/failures/state", "/xplane/camera/camera_info")
        }
    states = read["/xplane/flight_state"]
    assert [time for time, _ in states] == [stamp_ns(t) for t in TIMES]
    assert [state.roll_deg for _, state in states] == [state_at(t)["roll_deg"] for t in TIMES]
    assert [state.angular_velocity.x for _, state in states] == [state_at(t)["p"] for t in TIMES]
    assert not hasattr(states[0][1].header, "seq")
    (failure,) = (message for _, message in read["/xplane/failures/state"])
    assert failure.names == ["aileron1_left", "engine_1", "pitot_1"]
    assert failure.active.tolist() == [True, True, False]
    assert read["/xplane/camera/camera_info"][0][1].k[0] == 30.0, "ROS 2's name of the matrix"


def test_every_topic_of_an_old_bag_goes_into_a_ros2_bag(tmp_path: Path) -> None:
    assert export(OLD_BAG, "--format", "ros2", "-o", tmp_path) == 0
    folder = tmp_path / f"{OLD_BAG.stem}.ros2"
    with AnyReader([folder]) as reader:
        assert {c.topic: c.msgcount for c in reader.connections} == counts(OLD_BAG)
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)
    with sqlite3.connect(str(folder / f"{folder.name}.db3")) as database:
        topics = dict(database.execute("SELECT name, offered_qos_profiles FROM topics"))
    assert "durability: 1" in topics["/xplane/link_state"], "latched there, transient local in ROS 2"
    assert "durability: 1" not in topics["/xplane/flight_state"]


@pytest.mark.parametrize("form", ["mcap", "ros2"])
def test_topics_choose_and_split_bags_come_in_order(tmp_path: Path, form: str) -> None:
    folder = tmp_path / "flight"
    folder.mkdir()
    write_flight(folder / "b.bag", 1.0)
    write_flight(folder / "a.bag", 1.0, offset=0.01)
    if form == "mcap":
        reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    assert export(folder, "--format", form, "--topics", "odom", "control/mode", "-o", tmp_path) == 0
    if form == "mcap":
        with (tmp_path / "flight.mcap").open("rb") as file:
            found = [(c.topic, m.log_time) for _, c, m in reader.make_reader(file).iter_messages(log_time_order=False)]
    else:
        with AnyReader([tmp_path / "flight.ros2"]) as ros2:
            found = [(connection.topic, time) for connection, time, _ in ros2.messages()]
    assert {topic for topic, _ in found} == {"/xplane/odom", "/xplane/control/mode"}
    assert len(found) == 2 * (50 + 3)
    assert [time for _, time in found] == sorted(time for _, time in found)


@pytest.mark.parametrize("form", ["mcap", "ros2"])
def test_times_over_a_clock_set_back_are_those_of_the_file(tmp_path: Path, form: str) -> None:
    if form == "mcap":
        reader = pytest.importorskip("mcap.reader", reason="mcap is not installed")
    record_a_clock_set_back(tmp_path / "flight.bag", step=6.0)
    assert export(tmp_path / "flight.bag", "--format", form, "-o", tmp_path) == 0
    if form == "mcap":
        with (tmp_path / "flight.mcap").open("rb") as file:
            found = [m.log_time for *_, m in reader.make_reader(file).iter_messages(log_time_order=False)]
    else:
        with sqlite3.connect(str(tmp_path / "flight.ros2" / "flight.ros2.db3")) as database:
            found = [time for (time,) in database.execute("SELECT timestamp FROM messages ORDER BY id")]
    assert found == [stamp_ns(k / 50 - (6.0 if k >= 50 else 0.0)) for k in range(100)], "in the order of recording"


def test_a_topic_with_two_definitions_does_not_become_one_in_ros2(
    tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    folder = tmp_path / "flight"
    folder.mkdir()
    for name, added in (("a", "# only a comment\n"), ("b", ""), ("c", "uint8 more\n")):
        with FlightBag(folder / f"{name}.bag") as bag:
            text = bag.definitions.text
            bag.definitions.text = lambda msgtype, text=text, added=added: added + text(msgtype)
            raw = (b"\x00" if added.startswith("uint8") else b"") + b"\x02\x00\x00\x00hi"
            bag.add_raw("/label", "std_msgs/String", stamp_ns(0), raw)
    assert export(folder / "a.bag", folder / "b.bag", "--format", "ros2", "-o", tmp_path / "one") == 0
    (folder / "c.bag").rename(tmp_path / "c.bag")
    assert export(folder, "--format", "ros2", "-o", tmp_path / "same") == 0, "comments do not matter"
    (tmp_path / "c.bag").rename(folder / "c.bag")
    assert export(folder, "--format", "ros2", "-o", tmp_path / "both") == 1
    assert "/label: its messages have two definitions" in capsys.readouterr().err


def test_unknown_topics_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    bag = write_flight(tmp_path / "flight.bag", 0.2)
    assert export(bag, "--format", "ros2", "--topics", "engine", "-o", tmp_path) == 1
    assert "no topic /xplane/engine" in capsys.readouterr().err
    assert not list(tmp_path.glob("*.ros2"))
