"""What wire_replay writes with --anonymise and --regression, and reads with --expect; without a node."""

from __future__ import annotations

import json
import struct
import xmlrpc.client
from pathlib import Path

import pytest

from support.simulator.udp_packets import udp
from xplane_bridge.cli.wire import wire_replay
from xplane_bridge.cli.wire.wire_replay import main
from xplane_bridge.harness.processes import HarnessError
from xplane_bridge.harness.wire_replay import Message
from xplane_bridge.wire_log.capture import Capture, Packet, write_pcapng
from xplane_bridge.wire_log.own_log import OwnLog

XPLANE, OTHER, OURS = ("192.168.1.5", 49000), ("192.168.1.6", 49000), ("192.168.1.9", 50002)


def log(path: Path, first: int = 0, source: tuple[str, int] = XPLANE) -> Path:
    """A part of a wire log, with two packets."""
    node = path.name.split(".")[1].partition("_part")[0]
    head = {"node": f"/x/{node}", "program": node, "namespace": "/x", "ordered": True, "shared": {"host": "there"}}
    text = xmlrpc.client.dumps((head,))
    comment = text[text.index("<value>") : text.rindex("</value>") + 8].replace("\n", "")
    packets = [
        Packet(1, 5, udp(source, OURS, b"says"), f"n={first} w=5 s=5"),
        Packet(1, 6, udp(OURS, XPLANE, b"asks"), f"n={first + 1} w=6 s=6", outbound=True),
    ]
    interfaces = [(147, f"{node}/notes", ""), (101, f"{node}/control", "port 50002")]
    path.write_bytes(b"".join(write_pcapng(interfaces, iter(packets), comment, "a test")))
    return path


def strangers(path: Path) -> Path:
    """A capture with two X-Planes, the second with more to say."""
    row = b"DATA*" + struct.pack("<i8f", 3, *range(8))
    packets = [Packet(0, k, udp(source, OURS, row)) for k, source in enumerate((XPLANE, OTHER, OTHER))]
    path.write_bytes(b"".join(write_pcapng([(101, "", "")], iter(packets), "", "dumpcap")))
    return path


@pytest.fixture
def replays(monkeypatch):
    """How nodes were started; each publishes one message, or fails."""
    starts = []

    class Replay:
        fails = False

        def __init__(self, start, records, *_, **__):
            assert records.is_file()
            starts.append(start)
            self.messages = [Message("/x/odom", 1, b"same")]

        def write_bag(self, path):
            path.write_bytes(b"a bag")

        def run(self, *_):
            if self.fails:
                raise HarnessError("the node has failed")
            return "replayed 1 datagrams"

    monkeypatch.setattr(wire_replay, "WireReplay", Replay)
    starts.append(Replay)
    return starts


@pytest.mark.usefixtures("replays")
def test_the_recordings_of_two_nodes_are_kept_beside_each_other(tmp_path):
    kept = tmp_path / "kept"
    for node in ("rx_node", "tx_node"):
        assert main([str(log(tmp_path / f"wire.{node}.pcapng")), "--regression", str(kept)]) == 0
    names = [f"wire.{node}.{ending}" for node in ("rx_node", "tx_node") for ending in ("json", "pcapng")]
    assert sorted(path.name for path in kept.iterdir()) == names
    for node in ("rx_node", "tx_node"):
        assert OwnLog(kept / f"wire.{node}.pcapng").node == f"/x/{node}"
        assert b"192.168" not in (kept / f"wire.{node}.pcapng").read_bytes()


def test_what_is_kept_is_not_written_over(tmp_path, replays, capsys):
    kept, path = tmp_path / "kept", log(tmp_path / "wire.rx_node.pcapng")
    assert main([str(path), "--regression", str(kept)]) == 0
    before = {each.name: each.read_bytes() for each in kept.iterdir()}
    log(path, source=OTHER)
    assert main([str(path), "--regression", str(kept)]) == 1
    recording = kept / path.name
    assert (
        f"{path} would be kept as {recording}, and {kept / 'wire.rx_node.json'} is there already: give another folder"
        in capsys.readouterr().err
    )
    (kept / "wire.rx_node.json").unlink()
    assert main([str(path), "--regression", str(kept)]) == 1
    assert f"{recording} is there already and is kept: delete it, or write {path} else" in capsys.readouterr().err
    assert recording.read_bytes() == before[path.name]
    assert len(replays) == 2  # the first alone, behind the class
    # Nor a recording that lies there with all addresses.
    assert main([str(recording), "--regression", str(kept)]) == 1
    assert f"{recording} lies in {kept} itself" in capsys.readouterr().err


def test_nothing_is_kept_of_a_replay_that_fails(tmp_path, replays):
    kept, path = tmp_path / "kept", log(tmp_path / "wire.rx_node.pcapng")
    replays[0].fails = True
    assert main([str(path), "--regression", str(kept)]) == 1
    assert list(kept.iterdir()) == []
    replays[0].fails = False
    assert main([str(path), "--regression", str(kept)]) == 0


def test_what_was_kept_stays_whatever_is_done_with_the_replay(tmp_path, replays, capsys):
    kept, path = tmp_path / "kept", log(tmp_path / "wire.rx_node.pcapng")
    assert main([str(path), "--regression", str(kept), "--against", str(tmp_path / "nothing.bag")]) == 1
    assert "nothing.bag cannot be read: No such file" in capsys.readouterr().err
    assert sorted(each.name for each in kept.iterdir()) == ["wire.rx_node.json", "wire.rx_node.pcapng"]
    assert len(replays) == 2


def test_options_are_kept_in_disguise_and_used_again(tmp_path, replays, capsys):
    kept = tmp_path / "kept"
    given = ["--xplane", XPLANE[0], "--set", f"host={XPLANE[0]}", "--set", "aircraft=quadrotor"]
    assert main([str(strangers(tmp_path / "mine.pcap")), "--regression", str(kept), *given]) == 0
    capture, file = kept / "mine.pcapng", kept / "mine.json"
    # In the order of the datagrams: X-Plane, the asking computer, the other X-Plane.
    content = json.loads(file.read_text(encoding="utf-8"))
    assert content["options"] == {"xplane": "10.0.0.1", "set": {"host": "10.0.0.1", "aircraft": "quadrotor"}}
    assert set(content["topics"]) == {"/x/odom"}
    assert main([str(capture), "--expect", str(file)]) == 0
    assert main([str(capture), "--expect", str(file), "--set", "aircraft=helicopter"]) == 0
    assert main([str(capture), "--regression", str(kept)]) == 0  # anew
    assert json.loads(file.read_text(encoding="utf-8")) == content
    first, again, other, anew = (start.shared for start in replays[1:])
    assert first == again == anew
    assert (first["host"], first["aircraft"]) == ("10.0.0.1", "quadrotor")
    assert (other["host"], other["aircraft"]) == ("10.0.0.1", "helicopter")
    assert capsys.readouterr().out.count("X-Plane at 10.0.0.1: 0 answers with 0 datarefs, 1 datagrams") == 4


@pytest.mark.usefixtures("replays")
@pytest.mark.parametrize(("live", "code"), [(b"same", 0), (b"other", 1)])
@pytest.mark.parametrize("changed", [False, True])
def test_a_bag_is_written_and_compared_also_where_something_is_expected(tmp_path, monkeypatch, live, code, changed):
    kept, bag = tmp_path / "kept", tmp_path / "replay.bag"
    assert main([str(log(tmp_path / "wire.rx_node.pcapng")), "--regression", str(kept)]) == 0
    file = kept / "wire.rx_node.json"
    if changed:
        content = json.loads(file.read_text(encoding="utf-8"))
        content["topics"]["/x/odom"]["messages"] = 2
        file.write_text(json.dumps(content), encoding="utf-8")
    monkeypatch.setattr(wire_replay, "payloads_of", lambda *_: {"/x/odom": [live]})
    replay = [str(kept / "wire.rx_node.pcapng"), "--expect", str(file), "-o", str(bag), "--against", "flight.bag"]
    assert main(replay) == max(code, int(changed))
    assert bag.read_bytes() == b"a bag"


@pytest.mark.usefixtures("replays")
def test_an_address_that_is_not_in_the_recording_is_refused(tmp_path, capsys):
    path, kept = strangers(tmp_path / "mine.pcap"), tmp_path / "kept"
    assert main([str(path), "--regression", str(kept), "--xplane", "192.168.1.7"]) == 1
    assert f"--xplane 192.168.1.7: {path} has no datagram from or to it" in capsys.readouterr().err
    assert list(kept.iterdir()) == []
    with pytest.raises(SystemExit):
        main([str(path), "--xplane", "peters-laptop"])
    assert "expected an IPv4 address" in capsys.readouterr().err


@pytest.mark.usefixtures("replays")
def test_what_regression_has_not_written_is_refused(tmp_path, capsys):
    file = tmp_path / "other.json"
    for text in ("{}", "[1]", "no", '{"options": {"xplane": null, "set": {}}}'):
        file.write_text(text, encoding="utf-8")
        assert main([str(strangers(tmp_path / "mine.pcap")), "--expect", str(file)]) == 1
        assert "expected what --regression has written" in capsys.readouterr().err


@pytest.mark.usefixtures("replays")
def test_a_log_of_several_parts_is_anonymised_as_one(tmp_path, capsys):
    first = log(tmp_path / "wire.rx_node.pcapng")
    log(tmp_path / "wire.rx_node_part2.pcapng", 2, OTHER)
    out = tmp_path / "out.pcapng"
    assert main([str(first), "--anonymise", str(out)]) == 0
    again = OwnLog(out)
    assert again.parts() == [out, tmp_path / "out_part2.pcapng"]
    peers = [event.peer[0] for event in again.events() if event.payload in (b"asks", b"says")]
    assert peers == ["10.0.0.1", "10.0.0.1", "10.0.0.3", "10.0.0.1"]
    assert again.problem == ""
    # What lies there would be taken for a part, or is one.
    out.unlink()
    assert main([str(first), "--anonymise", str(out)]) == 1
    assert f"{tmp_path / 'out_part2.pcapng'} is there already and is kept: delete it" in capsys.readouterr().err
    assert not out.exists()
    assert main([str(tmp_path / "wire.rx_node_part2.pcapng"), "--anonymise", str(out)]) == 1
    assert main([str(first), "--anonymise", str(first)]) == 1
    assert len(list(Capture.open(first).packets())) == 2
    assert main([str(first), "--anonymise", str(tmp_path / "no" / "out.pcapng")]) == 1
    assert "out.pcapng cannot be written: No such file or directory; give a folder" in capsys.readouterr().err
    # Kept with both, and replayed with both.
    kept = tmp_path / "kept"
    assert main([str(first), "--regression", str(kept)]) == 0
    assert sorted(each.name for each in kept.iterdir()) == [
        "wire.rx_node.json",
        "wire.rx_node.pcapng",
        "wire.rx_node_part2.pcapng",
    ]


def test_what_is_not_replayed_is_said_after_the_replay(tmp_path, replays, capsys):
    path = tmp_path / "mine.pcap"
    request = b"RREF\0" + struct.pack("<ii", 20, 7) + b"sim/a".ljust(400, b"\0")
    row = b"DATA*" + struct.pack("<i8f", 3, *range(8))
    data = [
        udp(OURS, XPLANE, request),
        udp(XPLANE, OURS, b"RREF," + struct.pack("<if", 7, 1.5)),
        udp(XPLANE, OURS, row),
        udp(XPLANE, OURS, row)[:-1],
    ]
    packets = (Packet(0, k, each) for k, each in enumerate(data))
    path.write_bytes(b"".join(write_pcapng([(101, "", "")], packets, "", "dumpcap")))
    assert main([str(path)]) == 0
    said = capsys.readouterr().out
    assert said.index("replayed 1 datagrams") < said.index(
        "wire_replay: X-Plane at 192.168.1.5: 1 answers with 1 datarefs, 1 datagrams of Data Output, which are not "
        "replayed beside answers (--set transport=data takes them instead); 1 datagrams are not replayed because they "
        "were cut short"
    )
    assert main([str(path), "--set", "transport=data"]) == 0
    assert "beside answers" not in capsys.readouterr().out
    assert [start.shared["listen_for_beacon"] for start in replays[1:]] == [False, True]
