"""What wire_replay says of what it has found, without ROS."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from rosbags.rosbag1 import Writer

from xplane_bridge.cli.wire.wire_replay import (
    ReplayError,
    asks_on_demand,
    compare,
    hashes,
    main,
    payloads_of,
    prepare,
    start_of,
)
from xplane_bridge.wire_log.capture import Capture, Packet, write_pcapng
from xplane_bridge.wire_log.own_log import OwnLog

ABOUT = (
    "<value><struct><member><name>node</name><value>/x/rx_node</value></member><member><name>program</name>"
    "<value>rx_node</value></member><member><name>namespace</name><value>/x</value></member><member><name>ordered</name>"
    "<value><boolean>{ordered}</boolean></value></member><member><name>shared</name><value><struct><member>"
    "<name>host</name><value>there</value></member><member><name>wire_log</name><value>/tmp/a</value></member></struct>"
    "</value></member></struct></value>"
)
SENT = bytes([0x45, 0, 0, 29, 0, 0, 0, 0, 64, 17, 0, 0, 10, 9, 8, 6, 10, 9, 8, 7]) + struct.pack(
    ">HHHHB", 50000, 49000, 9, 0, 7
)


def log(path, ordered=1, notes=()):
    packets = [Packet(1, 5, SENT, "n=0 w=5 s=5", outbound=True)]
    packets += [Packet(0, 6, note, f"n={number} w=6 s=6") for number, note in enumerate(notes, 1)]
    interfaces = [(147, "rx_node/notes", ""), (101, "rx_node/control", "port 50000")]
    path.write_bytes(b"".join(write_pcapng(interfaces, iter(packets), ABOUT.format(ordered=ordered), "a test")))
    return path


def test_a_late_recorder_has_fewer_messages_and_any_other_difference_is_reported():
    replayed = {"/a": [b"1", b"2", b"3", b"4"], "/b": [b"1"]}
    assert compare({"/a": [b"2", b"3"], "/b": [b"1"]}, replayed) == [("/a", ""), ("/b", "")]
    assert compare({"/a": [b"2", b"4"]}, replayed) == [("/a", "message 1 of 2 differs")]
    assert compare({"/a": [b"4", b"5"]}, replayed) == [("/a", "message 1 of 2 differs")]
    assert compare({"/a": [b"9"]}, replayed) == [("/a", "the first live message is not in the replay")]
    assert compare({"/c": [b"1"]}, replayed) == [("/c", "not in the replay (1 live)")]


def test_a_late_recorder_may_begin_at_any_of_equal_messages():
    def said(live, replayed):
        return compare({"/a": [b"%d" % i for i in live]}, {"/a": [b"%d" % i for i in replayed]})[0][1]

    assert said([1, 2], [1, 1, 2]) == ""
    assert said([1, 1, 2], [1, 1, 1, 1, 2, 3]) == ""
    assert said([1, 2, 1, 3], [1, 2, 1, 2, 1, 3]) == ""
    assert said([1, 1, 2, 4], [1, 1, 3, 1, 1, 1, 2, 5]) == "message 3 of 4 differs"
    assert said([1, 1, 1], [1, 1, 2, 1]) == "message 2 of 3 differs"
    assert said([1] * 50000 + [2], [1] * 99999 + [2]) == ""  # in time, too
    random = np.random.default_rng(1)
    for _ in range(300):
        live, replayed = random.integers(2, size=4).tolist(), random.integers(2, size=9).tolist()
        runs = [n for n in range(5) if any(replayed[i : i + n] == live[:n] for i in range(10 - n))]
        words = {0: "the first live message is not in the replay", 4: ""}
        assert said(live, replayed) == words.get(max(runs), f"message {max(runs)} of 4 differs")


def test_messages_are_in_the_order_of_recording_also_where_ros_time_goes_back(tmp_path):
    """As with use_sim_time, where X-Plane begins anew; rosbag's index is in order of time."""
    bag = tmp_path / "flight.bag"
    with Writer(bag) as writer:
        texts = [
            writer.add_connection(topic, "std_msgs/msg/String", msgdef="string data", md5sum="0" * 32, callerid=node)
            for topic, node in (("/a", "/x/rx_node"), ("/a", "/x/other"), ("/x/experiment", "/x/rx_node"))
        ]
        for number, time in enumerate((50, 60, 3, 70, 13)):
            writer.write(texts[0], time, b"%d" % number)
            writer.write(texts[1], time, b"another's")
            writer.write(texts[2], time, b"of the start")
        for entries in writer.chunks[-1].connections.values():
            entries.sort()
    assert payloads_of(bag, "/x/rx_node") == {"/a": [b"0", b"1", b"2", b"3", b"4"]}


def test_other_aircraft_are_compared_where_the_log_says_when_they_were_asked_for(tmp_path):
    assert asks_on_demand(log(tmp_path / "w.rx_node.pcapng", notes=[b"traffic wanted\0", b"close\0"]))
    assert not asks_on_demand(log(tmp_path / "earlier.rx_node.pcapng", notes=[b"close\0"]))
    stranger = tmp_path / "stranger.pcapng"
    stranger.write_bytes(b"".join(write_pcapng([], iter(()), "", "a test")))
    assert not asks_on_demand(stranger)


def test_hashes_show_where_messages_begin():
    assert hashes({"/a": [b"12", b"3"]}) != hashes({"/a": [b"1", b"23"]})


def test_the_node_is_started_as_it_was_and_finds_x_plane_by_its_address(tmp_path):
    start = start_of(OwnLog(log(tmp_path / "w.rx_node.pcapng")))
    assert (start.program, start.node, start.namespace) == ("rx_node", "/x/rx_node", "/x")
    assert start.shared == {"host": "10.9.8.7", "listen_for_beacon": True}
    start, word = prepare(tmp_path / "w.rx_node.pcapng", tmp_path / "records", None, {"host": "10.1.1.1"})
    assert start.shared["host"] == "10.1.1.1"
    assert word == ""
    assert (tmp_path / "records").read_bytes().startswith(b"xplane_bridge wire records 1\n")


def test_datagrams_alone_cannot_be_replayed(tmp_path):
    with pytest.raises(ReplayError, match="but not what else it went by"):
        start_of(OwnLog(log(tmp_path / "w.tx_node.pcapng", ordered=0)))


def test_the_program_anonymises(tmp_path, capsys):
    path, out = log(tmp_path / "w.rx_node.pcapng"), tmp_path / "out.pcapng"
    assert main([str(path), "--anonymise", str(out)]) == 0
    assert b"there" not in out.read_bytes()
    assert len(list(Capture.open(out).packets())) == 1
    assert main([str(tmp_path / "nothing.pcapng")]) == 1
    assert "cannot be read: No such file" in capsys.readouterr().err


@pytest.mark.parametrize(
    "option", ["--output", "--against", "--sent", "--xplane", "--set", "--regression", "--expect", "--logs"]
)
def test_what_an_anonymised_recording_has_no_use_for_is_refused(tmp_path, capsys, option):
    path, out = log(tmp_path / "w.rx_node.pcapng"), tmp_path / "out.pcapng"
    value = {"--xplane": "10.9.8.7", "--set": "port=49000"}.get(option, str(tmp_path / "other"))
    assert main([str(path), "--anonymise", str(out), option, value]) == 1
    assert f"{option}: not with --anonymise {out}" in capsys.readouterr().err
    assert not out.exists()


def test_x_plane_of_the_bridges_own_log_is_in_it(tmp_path, capsys):
    path = log(tmp_path / "w.rx_node.pcapng")
    assert main([str(path), "--xplane", "10.9.8.7", "--regression", str(tmp_path / "kept")]) == 1
    assert "--xplane 10.9.8.7: only with a capture of another program" in capsys.readouterr().err
    assert not (tmp_path / "kept").exists()


def test_where_nothing_can_be_written_is_said_before_the_replay(tmp_path, capsys):
    path, there = log(tmp_path / "w.rx_node.pcapng"), tmp_path / "there"
    there.write_text("")
    for option, file, said in (
        ("--output", there, "is there already and is kept"),
        ("--output", there / "replay.bag", f"{there} cannot be written: File exists"),
        ("--regression", there, f"{there} cannot be written: File exists"),
    ):
        assert main([str(path), option, str(file)]) == 1
        assert said in capsys.readouterr().err
    assert there.read_text() == ""


def test_a_parameter_is_given_as_key_and_value(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main([str(tmp_path / "x"), "--set", "transport"])
    assert "expected KEY=VALUE" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main([str(tmp_path / "x"), "--set", "rates=[1"])
    assert "'rates=[1': the value does not parse as YAML: line 1, column 3: expected ','" in capsys.readouterr().err
