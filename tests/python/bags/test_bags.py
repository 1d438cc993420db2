"""Bags are written from bytes packed here by hand, so that the reader cannot agree with itself on a mistake."""

from __future__ import annotations

import bz2
import struct
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer

from support.flights.cut_off import cut_off, without_index
from xplane_bridge.bags import BagError, Bags
from xplane_bridge.bags.chunks import BagFile
from xplane_bridge.bags.columns import ColumnFile
from xplane_bridge.bags.files import bags_in

HEADER = "uint32 seq\ntime stamp\nstring frame_id\n"
SEP = "=" * 80 + "\n"
STATE = (
    "uint32 GOOD = 7\nHeader header\nfloat64 x\nfloat32[3] axes\nbool on\nduration age\nint16 step\n"
    + SEP
    + "MSG: std_msgs/Header\n"
    + HEADER
)
MD5 = "0" * 32


def header(seq: int, sec: int, nsec: int, frame: bytes) -> bytes:
    return struct.pack("<IIII", seq, sec, nsec, len(frame)) + frame


def state(k: int, frame: bytes = b"base_link_frd") -> bytes:
    body = struct.pack("<d3f?iih", k + 0.5, k, 2 * k, -k, k % 2 == 0, -k, 250, -5 * k)
    return header(k, 1000 + k, 7, frame) + body


def write(path: Path, topics: list, compression: object = None) -> Path:
    """Topics: (name, type, definition, [(time ns, bytes)])."""
    writer = Writer(path)
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        for topic, msgtype, definition, messages in topics:
            connection = writer.add_connection(topic, msgtype, msgdef=definition, md5sum=MD5)
            for time, raw in messages:
                writer.write(connection, time, raw)
    return path


def flight(path: Path, count: int = 5, start: int = 0, **kwargs: object) -> Path:
    messages = [(10 * (k + 1), state(k)) for k in range(start, start + count)]
    return write(path, [("/s", "pkg/msg/State", STATE, messages)], **kwargs)


def test_bags_that_are_not_open_say_so(tmp_path: Path) -> None:
    bags = Bags(flight(tmp_path / "a.bag"))
    reads = (lambda: bags.topics, lambda: bags.read("/s"), lambda: list(bags.messages("/s")))
    for read in reads:
        with pytest.raises(BagError, match=r"a\.bag: not open; expected `with Bags\("):
            read()
    with bags:
        assert len(bags.read("/s")) == 5
    with pytest.raises(BagError, match="not open"):
        reads[0]()


def test_every_kind_of_field_is_decoded_to_its_column(tmp_path: Path) -> None:
    with Bags(flight(tmp_path / "a.bag")) as bags:
        table = bags.read("/s")
        assert bags.constants("/s") == {"GOOD": 7}
    assert len(table) == 5
    assert table.msgtype == "pkg/State"
    np.testing.assert_array_equal(table.time, [10, 20, 30, 40, 50])
    np.testing.assert_array_equal(table.stamp, [(1000 + k) * 10**9 + 7 for k in range(5)])
    np.testing.assert_array_equal(table["x"], [0.5, 1.5, 2.5, 3.5, 4.5])
    np.testing.assert_array_equal(table["axes"], [[k, 2 * k, -k] for k in range(5)])
    np.testing.assert_array_equal(table["on"], [True, False, True, False, True])
    np.testing.assert_array_equal(table["age"], [0.00000025, -0.99999975, -1.99999975, -2.99999975, -3.99999975])
    np.testing.assert_array_equal(table["step"], [0, -5, -10, -15, -20])
    assert list(table["header.frame_id"]) == ["base_link_frd"] * 5
    assert table["axes"].dtype == np.float32


def test_a_message_whose_stamp_is_zero_has_the_time_of_its_receipt(tmp_path: Path) -> None:
    zero = header(1, 0, 0, b"") + state(1, b"")[16:]
    messages = [(10, state(0)), (1005 * 10**9, zero), (1006 * 10**9, state(2))]
    path = write(tmp_path / "a.bag", [("/s", "pkg/msg/State", STATE, messages)])
    for store in (None, ColumnFile(tmp_path)):
        with Bags(path) as bags:
            table = bags.read("/s", store=store)
        assert table.stamp.tolist() == [1000 * 10**9 + 7, 1005 * 10**9, 1002 * 10**9 + 7]
        assert table.by_stamp()["x"].tolist() == [0.5, 2.5, 1.5]
        assert table["header.stamp"].tolist()[1] == 0, "what was recorded is still to be seen"


def test_strings_of_changing_length_keep_order_and_values(tmp_path: Path) -> None:
    frames = [b"map", b"odom", b"map", b"", b"axe"]  # "map" and "axe" share a length, not a value
    messages = [(k, state(k, frame)) for k, frame in enumerate(frames)]
    with Bags(write(tmp_path / "a.bag", [("/s", "pkg/msg/State", STATE, messages)])) as bags:
        table = bags.read("/s")
    assert list(table["header.frame_id"]) == ["map", "odom", "map", "", "axe"]
    np.testing.assert_array_equal(table["x"], [0.5, 1.5, 2.5, 3.5, 4.5])


def test_equal_sizes_with_lengths_moved_between_fields_are_distinguished(tmp_path: Path) -> None:
    definition = "string a\nstring b\n"
    raws = [b"\1\0\0\0x\3\0\0\0abc", b"\3\0\0\0abc\1\0\0\0x", b"\1\0\0\0y\3\0\0\0def"]
    with Bags(write(tmp_path / "a.bag", [("/t", "pkg/msg/T", definition, list(enumerate(raws)))])) as bags:
        table = bags.read("/t")
    assert list(table["a"]) == ["x", "abc", "y"]
    assert list(table["b"]) == ["abc", "x", "def"]


def test_lists_of_numbers_vary_and_lists_of_messages_stay_objects(tmp_path: Path) -> None:
    definition = "float32[] v\n"
    raws = [struct.pack("<I2f", 2, 1.5, 2.5), struct.pack("<I", 0), struct.pack("<I1f", 1, 9.0)]
    nested = "Item[] items\nuint8 n\n" + SEP + "MSG: pkg/Item\nint32 k\nstring s\n"
    item = struct.pack("<I", 2) + struct.pack("<iI1s", 5, 1, b"a") + struct.pack("<iI0s", 6, 0, b"") + b"\2"
    path = write(
        tmp_path / "a.bag",
        [("/l", "pkg/msg/L", definition, list(enumerate(raws))), ("/n", "pkg/msg/N", nested, [(0, item)])],
    )
    with Bags(path) as bags:
        values = bags.read("/l")["v"]
        table = bags.read("/n")
    assert [list(v) for v in values] == [[1.5, 2.5], [], [9.0]]
    assert [(i.k, i.s) for i in table["items"][0]] == [(5, "a"), (6, "")]
    assert table["n"][0] == 2


def test_bytes_are_signed_and_chars_are_not(tmp_path: Path) -> None:
    fields = "byte one\nbyte[2] two\nbyte[] list\nchar letter\n"
    raw = b"\xff" + b"\xfe\x02" + struct.pack("<I", 1) + b"\x80" + b"\xff"
    for definition, message in ((fields, raw), (fields + "string[] names\n", raw + struct.pack("<I", 0))):
        path = tmp_path / f"{len(message)}.bag"
        with Bags(write(path, [("/t", "pkg/msg/T", definition, [(0, message), (1, message)])])) as bags:
            table = bags.read("/t")
        assert table["one"].tolist() == [-1, -1]
        assert table["two"].tolist() == [[-2, 2]] * 2
        assert [list(values) for values in table["list"]] == [[-128]] * 2
        assert table["letter"].tolist() == [255, 255]


def test_lists_beside_texts_stay_lists_where_all_have_one_length(tmp_path: Path) -> None:
    definition = "string[] names\nfloat32[] values\nfloat32[2] axes\n"
    raws = [struct.pack("<II1sI3f", 1, 1, b"a", 1, k, k + 1, k + 2) for k in range(3)]
    path = write(tmp_path / "a.bag", [("/l", "pkg/msg/L", definition, list(enumerate(raws)))])
    for store in (None, ColumnFile(tmp_path)):
        with Bags(path) as bags:
            table = bags.read("/l", store=store)
        assert [list(value) for value in table["values"]] == [[0.0], [1.0], [2.0]]
        assert table["values"].dtype == object, "another flight has lists of other lengths in this column"
        assert table["axes"].tolist() == [[1.0, 2.0], [2.0, 3.0], [3.0, 4.0]]


def test_durations_beside_texts_are_seconds_too(tmp_path: Path) -> None:
    definition = "string[] names\nduration age\ntime at\n"
    raws = [struct.pack("<IiiII", 0, -1, 500_000_000, 3, 4), struct.pack("<IiiII", 0, 2, 250_000_000, 5, 6)]
    with Bags(write(tmp_path / "a.bag", [("/l", "pkg/msg/L", definition, list(enumerate(raws)))])) as bags:
        table = bags.read("/l")
    assert table["age"].tolist() == [-0.5, 2.25]
    assert table["at"].tolist() == [3 * 10**9 + 4, 5 * 10**9 + 6]


def test_columns_can_be_selected_alone_or_as_a_group(tmp_path: Path) -> None:
    with Bags(flight(tmp_path / "a.bag")) as bags:
        assert sorted(bags.read("/s", ["x"]).columns) == ["x"]
        assert sorted(bags.read("/s", ["header"]).columns) == ["header.frame_id", "header.seq", "header.stamp"]
        with pytest.raises(BagError, match="no column 'speed'"):
            bags.read("/s", ["speed"])
        with pytest.raises(BagError, match=r"no topic /q .* there is: /s"):
            bags.read("/q")
        with pytest.raises(BagError, match="it has: age, axes"):
            bags.read("/s")["speed"]


def test_compressed_bags_read_the_same(tmp_path: Path) -> None:
    with Bags(flight(tmp_path / "plain.bag", 50)) as bags:
        plain = bags.read("/s")
    for kind in Writer.CompressionFormat:
        with Bags(flight(tmp_path / f"{kind.name}.bag", 50, compression=kind)) as bags:
            table = bags.read("/s")
        for name, column in plain.columns.items():
            np.testing.assert_array_equal(table[name], column)


def test_split_bags_are_one_flight_in_receive_order(tmp_path: Path) -> None:
    flight(tmp_path / "f_0.bag", 3, 0)
    flight(tmp_path / "f_1.bag", 4, 3)
    for paths in ([tmp_path / "f_1.bag", tmp_path / "f_0.bag"], tmp_path):
        with Bags(paths) as bags:
            assert bags.topics["/s"].count == 7
            assert (bags.topics["/s"].first_time, bags.topics["/s"].last_time) == (10, 70)
            np.testing.assert_array_equal(bags.read("/s")["x"], np.arange(7) + 0.5)
            assert [time for time, _ in bags.messages("/s")] == [10, 20, 30, 40, 50, 60, 70]


def test_messages_of_some_spans_come_alone_and_the_rest_is_not_read(tmp_path: Path) -> None:
    path = flight(tmp_path / "a.bag", 200, compression=Writer.CompressionFormat.BZ2)
    flight(tmp_path / "b.bag", 3, 200)
    with Bags([path, tmp_path / "b.bag"]) as bags:
        spans = [(40, 59), (50, 70), (2000, 2010)]
        assert [time for time, _ in bags.messages("/s", spans)] == [40, 50, 60, 70, 2000, 2010]
        assert list(bags.messages("/s", [(41, 49)])) == []
        assert list(bags.messages("/s", [])) == []
    damage(path, lambda raw: raw.replace(b"BZh", b"BZx"))
    with Bags([path, tmp_path / "b.bag"]) as bags:
        assert [message.x for _, message in bags.messages("/s", [(2020, 2030)])] == [201.5, 202.5]


def test_messages_of_all_topics_come_in_order_of_time_whatever_chunk_they_are_in(tmp_path: Path) -> None:
    times = [9, 30, 31, 32, 1, 9, 40, 5, 3, 9, 3, 2, 8, 50, 41]
    path = tmp_path / "a.bag"
    writer = Writer(path)
    writer.chunk_threshold = 100  # bytes: few messages
    with writer:
        to = [writer.add_connection(f"/{name}", "pkg/msg/N", msgdef="uint32 n\n", md5sum=MD5) for name in "ab"]
        for k, time in enumerate(times):
            writer.write(to[k % 2], time, struct.pack("<I", k))
    for topics in ((), ("/a",), ("/b",)):
        with Bags(path) as bags:
            seen = [(time, struct.unpack("<I", raw)[0]) for _, time, raw in bags.recorded(topics)]
        wanted = [(time, k) for k, time in enumerate(times) if not topics or topics == (f"/{'ab'[k % 2]}",)]
        assert seen == sorted(wanted)


def test_mixed_versions_read_each_by_its_own_definition(tmp_path: Path) -> None:
    write(tmp_path / "old.bag", [("/v", "pkg/msg/V", "float64 a\n", [(1, struct.pack("<d", 1.25))])])
    write(tmp_path / "new.bag", [("/v", "pkg/msg/V", "float64 a\nuint8 b\n", [(2, struct.pack("<dB", 2.5, 9))])])
    with Bags([tmp_path / "old.bag", tmp_path / "new.bag"]) as bags:
        # Both carry the same dummy md5: the definition itself must decide.
        table = bags.read("/v")
    np.testing.assert_array_equal(table["a"], [1.25, 2.5])
    assert np.isnan(table["b"][0])
    assert table["b"][1] == 9


def test_a_message_that_does_not_fit_its_definition_is_named(tmp_path: Path) -> None:
    path = write(tmp_path / "a.bag", [("/t", "pkg/msg/T", "float64 a\n", [(1, b"\0" * 9)])])
    with Bags(path) as bags, pytest.raises(BagError, match=r"/t: .*9 bytes, its definition takes 8"):
        bags.read("/t")


def test_topic_of_type_and_empty_topics(tmp_path: Path) -> None:
    path = write(
        tmp_path / "a.bag",
        [("/b/s", "pkg/msg/State", STATE, []), ("/a/s", "pkg/msg/State", STATE, [(1, state(1))])],
    )
    with Bags(path) as bags:
        assert bags.topic_of_type("pkg/State") == "/a/s"
        assert bags.topic_of_type("pkg/State", "/b/s") == "/b/s"
        assert bags.topic_of_type("pkg/Other") is None
        assert bags.topics["/b/s"].count == 0
        assert len(bags.read("/b/s")) == 0


@pytest.mark.parametrize("spaces", [("/lead", "/wing"), ("", "/wing"), ("/lead", "/lead/wing")])
def test_the_bridges_types_are_not_taken_from_another_aircraft(tmp_path: Path, spaces: tuple[str, str]) -> None:
    first, second = spaces
    topics = [(f"{space}/flight_state", "xplane_bridge/msg/FlightState") for space in spaces]
    topics += [(f"{second}/control/mode", "xplane_bridge/msg/ControlMode"), (f"{second}/wind", "pkg/msg/Wind")]
    path = write(tmp_path / "a.bag", [(topic, msgtype, STATE, [(1, state(1))]) for topic, msgtype in topics])
    with Bags(path) as bags:
        assert bags.topic_of_type("xplane_bridge/FlightState") == f"{first}/flight_state"
        assert bags.topic_of_type("xplane_bridge/ControlMode") is None
        assert bags.topic_of_type("pkg/Wind") == f"{second}/wind", "common types are found wherever they are"


def damage(path: Path, change: object) -> Path:
    path.write_bytes(change(path.read_bytes()))
    return path


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda _: b"", "the file is empty"),
        (lambda raw: bz2.compress(raw), "not a ROS 1 bag"),
        (lambda raw: raw[: len(raw) * 2 // 3], "rosbag reindex"),
        (lambda raw: raw[:40], "rosbag reindex"),
        (lambda raw: raw.replace(b"#ROSBAG V2.0", b"#ROSBAG V1.2"), "not a ROS 1 bag of version 2.0"),
        (lambda raw: raw.replace(b"op=\x05", b"op=\x06"), "not one whole chunk"),
    ],
)
def test_bad_files_are_refused_in_one_line_with_the_remedy(tmp_path: Path, change: object, text: str) -> None:
    path = damage(flight(tmp_path / "bad.bag", 200), change)
    with pytest.raises(BagError, match=text) as caught, Bags(path):
        pass
    assert "\n" not in str(caught.value)
    assert "bad.bag" in str(caught.value)


def test_missing_paths_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="No such file"), Bags(tmp_path / "none.bag"):
        pass
    with pytest.raises(BagError, match=r"without any \.bag"):
        Bags(tmp_path)
    with pytest.raises(BagError, match="no bag given"):
        Bags([])


# -------------------------------------------------------------------------------------- recordings that were cut off


def long_flight(path: Path, count: int = 3000) -> tuple[Path, list[int]]:
    """A bag of several chunks; also where in the file each chunk ends, as its own length says."""
    large = b"x" * 1000
    messages = [(10 * (k + 1), header(k, k, 0, large)) for k in range(count)]
    write(path, [("/s", "pkg/msg/State", STATE, [(15, state(0))]), ("/h", "std_msgs/msg/Header", HEADER, messages)])
    raw = path.read_bytes()
    ends, at = [], len("#ROSBAG V2.0\n")
    while at < len(raw):
        (size,) = struct.unpack_from("<I", raw, at)
        is_chunk = b"op=\x05" in raw[at : at + 4 + size]
        (data,) = struct.unpack_from("<I", raw, at + 4 + size)
        at += 8 + size + data
        if is_chunk:
            ends.append(at)
    return path, ends


@pytest.mark.parametrize("beyond", [0, 5, 4000])
def test_a_recording_that_was_cut_off_is_read_to_its_last_whole_chunk(tmp_path, caplog, beyond) -> None:
    path, ends = long_flight(tmp_path / "whole.bag")
    assert len(ends) >= 3
    with Bags(path) as bags:
        whole = bags.read("/h")
        assert len(whole) == 3000
    assert not caplog.records
    cut = tmp_path / "cut.bag"
    cut.write_bytes(without_index(path.read_bytes())[: ends[-2] + beyond])
    with Bags(cut) as bags:
        read = bags.read("/h")
        assert len(bags.read("/s")) == bags.topics["/s"].count == 1
        assert [time for time, _ in bags.messages("/h")] == list(read.time)
    assert 1000 < len(read) < 3000
    np.testing.assert_array_equal(read.time, whole.time[: len(read)])
    np.testing.assert_array_equal(read["seq"], np.arange(len(read)))
    (record,) = caplog.records
    assert "cut.bag: the recording was cut off; read to its last whole chunk" in record.getMessage()


def test_no_chunk_is_lost_that_was_whole(tmp_path: Path) -> None:
    path, ends = long_flight(tmp_path / "whole.bag")
    raw = without_index(path.read_bytes())
    counts = []
    for k, end in enumerate(ends):
        for beyond in (-1, 0):
            cut = tmp_path / f"{k}_{beyond}.bag"
            cut.write_bytes(raw[: end + beyond])
            if k or not beyond:
                with Bags(cut) as bags:
                    counts.append(bags.topics["/h"].count)
    assert counts[0] == counts[1] > 0  # one chunk; then the second, but for its last byte
    assert counts[1] < counts[2] == counts[3] < counts[4]
    assert counts[-1] == 3000


def test_a_recording_with_a_chunk_that_has_no_length_yet_is_read_up_to_it(tmp_path: Path) -> None:
    path, _ = long_flight(tmp_path / "whole.bag")
    raw = bytearray(without_index(path.read_bytes()))
    last = raw.rindex(b"op=\x05")
    header_end = raw.index(b"size=", last - 60) + 5 + 4
    raw[header_end : header_end + 4] = b"\0" * 4
    (tmp_path / "cut.bag").write_bytes(bytes(raw))
    with Bags(tmp_path / "cut.bag") as bags:
        assert 0 < bags.topics["/h"].count < 3000


def test_many_pieces_read_as_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, _ = long_flight(tmp_path / "a.bag")
    with Bags(path) as bags:
        at_once = bags.read("/h")
        monkeypatch.setattr("xplane_bridge.bags._PIECE_BYTES", 5000)
        in_pieces = bags.read("/h")
    assert at_once.columns.keys() == in_pieces.columns.keys()
    for name, column in at_once.columns.items():
        np.testing.assert_array_equal(column, in_pieces[name])


def test_a_chunk_that_does_not_unpack_is_named(tmp_path: Path) -> None:
    path = flight(tmp_path / "a.bag", 200, compression=Writer.CompressionFormat.BZ2)
    damage(path, lambda raw: raw.replace(b"BZh", b"BZx"))
    with Bags(path) as bags, pytest.raises(BagError, match=r"a\.bag: damaged data \(a chunk does not unpack"):
        bags.read("/s")


def test_what_reindexing_has_kept_of_a_bag_is_no_other_bag(tmp_path: Path) -> None:
    for name in ("b.bag", "b.orig.bag", "alone.orig.bag", "in/c.d.bag", "in/c.d.orig.bag"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    assert Bags(tmp_path).paths == [tmp_path / "alone.orig.bag", tmp_path / "b.bag"]
    assert bags_in(tmp_path, "**/*.bag") == [tmp_path / name for name in ("alone.orig.bag", "b.bag", "in/c.d.bag")]


def test_the_last_part_of_a_recording_that_was_cut_off_is_read(tmp_path: Path) -> None:
    parts = [flight(tmp_path / f"f_{number}.bag", 5, 5 * k) for k, number in enumerate((1, 2, 10))]
    parts[2] = cut_off(parts[2])
    cut_off(flight(tmp_path / "earlier.bag")).rename(tmp_path / "f_1.bag.active")  # of another, under that name
    assert Bags(tmp_path).paths == Bags([parts[2], parts[0], parts[1]]).paths == parts
    with Bags(tmp_path) as bags:
        np.testing.assert_array_equal(bags.read("/s")["x"], np.arange(15) + 0.5)


@pytest.mark.parametrize("size", [0, 20, 4200])
def test_a_recording_that_was_cut_off_before_its_first_chunk_is_left_out(tmp_path: Path, caplog, size: int) -> None:
    part, last = flight(tmp_path / "f_1.bag"), cut_off(flight(tmp_path / "f_2.bag"))
    last.write_bytes(last.read_bytes()[:size])
    assert Bags(tmp_path).paths == [part]
    (record,) = caplog.records
    assert record.getMessage().startswith(f"{last}: left out (")


def test_of_a_recording_that_was_cut_off_no_more_than_the_first_chunk_is_looked_at(tmp_path: Path, caplog) -> None:
    path = cut_off(long_flight(tmp_path / "f.bag")[0])
    probed, whole = BagFile(path, probe=True), BagFile(path)
    try:
        ids = [id_ for id_, connection in whole.connections.items() if connection.topic == "/h"]
        assert 0 < len(probed.times(ids[0])) < len(whole.times(ids[0])) == 3000
    finally:
        probed.close()
        whole.close()
    path.write_bytes(path.read_bytes()[:-5])
    with Bags(tmp_path):
        pass
    (record,) = caplog.records
    assert "the recording was cut off, or is still being recorded; read to its last whole chunk" in record.getMessage()


def test_a_part_that_is_renamed_meanwhile_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    active = flight(tmp_path / "f.bag").rename(tmp_path / "f.bag.active")
    look = Path.glob

    def renaming(folder: Path, pattern: str):
        found = list(look(folder, pattern))
        if active.exists():
            active.rename(tmp_path / "f.bag")
        return found

    monkeypatch.setattr(Path, "glob", renaming)
    assert bags_in(tmp_path) == [tmp_path / "f.bag"]
