"""What the doctor observes on the network: beacons, answers, ports, Data Output rows."""

import os
import socket
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import pytest

from support.deadlines import WAIT_S
from support.simulator.fake_xplane import FakeXPlane
from xplane_bridge import protocol
from xplane_bridge.doctor import names
from xplane_bridge.doctor.observe import beacons, computer, data_output, ports, simulator
from xplane_bridge.doctor.observe.beacons import BeaconWatch, Sighting
from xplane_bridge.doctor.observe.target import Chosen, addresses_of, choose, distinct
from xplane_bridge.doctor.settings import Settings
from xplane_bridge.harness import wait_until
from xplane_bridge.harness.ports import free_udp_port

GROUP = "239.255.1.1"
VALUES = {names.VERSION: 115501.0, FakeXPlane.TIME: 10.0, names.PAUSED: 0.0, names.REPLAY: 0.0, names.DATA_RATE: 20.0}


class Repeat:
    """Sends datagrams again and again, from a thread, within ``with``."""

    def __init__(self, to, *datagrams):
        self._to, self._datagrams = to, datagrams
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._end.set()
        self._thread.join()
        self._socket.close()

    def _run(self):
        while not self._end.wait(0.02):
            for datagram in self._datagrams:
                self._socket.sendto(datagram, self._to)


# --------------------------------------------------------------------------------------------------------- beacons


def test_each_x_plane_that_announces_itself_is_heard_once(monkeypatch):
    port = free_udp_port()
    flying = protocol.Beacon(115501, 49000, "lab-pc").encode()
    viewing = protocol.Beacon(115501, 49000, "screen-left", role=2).encode()
    opened = beacons._open

    def open_and_send(receiver, *where):
        """Only what is sent from now on is heard, and in this order."""
        interfaces = opened(receiver, *where)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
            for datagram in (flying, viewing, flying, viewing, b"hello"):
                sender.sendto(datagram, (GROUP, port))
        return interfaces

    def listened():
        watch = beacons.listen(GROUP, port, 0.5)
        return watch if watch.odd or watch.error else None  # with the last datagram all before it have been read

    monkeypatch.setattr(beacons, "_open", open_and_send)
    watch = wait_until(listened, WAIT_S, "datagram in the time of listening")
    assert watch.sightings == (
        Sighting("127.0.0.1", 49000, 115501, "lab-pc"),
        Sighting("127.0.0.1", 49000, 115501, "screen-left", flies=False),
    )
    assert watch.odd == 1
    assert "lo" in watch.interfaces
    assert not watch.error


def test_a_beacon_port_that_is_not_shared_is_an_error_in_words():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as hog:
        hog.bind(("", 0))
        assert beacons.listen(GROUP, hog.getsockname()[1], 0.1).error == os.strerror(98)  # Address already in use


def test_one_computer_with_two_addresses_is_one_x_plane():
    watch = [
        Sighting("192.0.2.1", 49000, 115501, "lab-pc"),
        Sighting("198.51.100.1", 49000, 115501, "lab-pc"),
        Sighting("192.0.2.1", 49010, 115501, "lab-pc"),
        Sighting("198.51.100.2", 49000, 120815, "lab-pc"),
        Sighting("192.0.2.9", 49000, 115501, "screen", flies=False),
    ]
    assert distinct(watch) == [
        (watch[0], ("192.0.2.1", "198.51.100.1")),
        (watch[2], ("192.0.2.1",)),
        (watch[3], ("198.51.100.2",)),
    ]


# ---------------------------------------------------------------------------------------------------------- target

HEARD = BeaconWatch((Sighting("192.0.2.1", 49007, 115501, "lab-pc"),))
HEARD_HERE = BeaconWatch((*HEARD.sightings, Sighting("127.0.0.1", 49008, 115501, "my-pc")))


@pytest.mark.parametrize(
    ("settings", "parameters", "watch", "expected"),
    [
        (Settings("192.0.2.5", 49100), {"host": "192.0.2.6"}, HEARD, ("192.0.2.5", 49100, Chosen.OPTION)),
        (Settings("192.0.2.5"), {}, HEARD, ("192.0.2.5", 49000, Chosen.OPTION)),
        (Settings("192.0.2.1"), {}, HEARD, ("192.0.2.1", 49007, Chosen.OPTION)),
        (Settings("127.0.0.2"), {}, HEARD_HERE, ("127.0.0.2", 49008, Chosen.OPTION)),
        (
            Settings("192.0.2.1", 49100),
            {"host": "192.0.2.1", "port": 49200},
            HEARD,
            ("192.0.2.1", 49100, Chosen.OPTION),
        ),
        (Settings("192.0.2.1"), {"host": "192.0.2.1", "port": 49200}, HEARD, ("192.0.2.1", 49200, Chosen.OPTION)),
        (Settings("127.0.0.1"), {"host": "localhost", "port": 49200}, HEARD, ("127.0.0.1", 49200, Chosen.OPTION)),
        (Settings("192.0.2.1"), {"host": "192.0.2.6", "port": 49200}, HEARD, ("192.0.2.1", 49007, Chosen.OPTION)),
        (Settings("192.0.2.1"), {"host": "", "port": 49200}, HEARD, ("192.0.2.1", 49007, Chosen.OPTION)),
        (Settings("127.0.0.1"), {"host": "no.invalid", "port": 9}, HEARD_HERE, ("127.0.0.1", 49008, Chosen.OPTION)),
        (Settings("no.invalid"), {"host": "127.0.0.1", "port": 9}, HEARD_HERE, ("", 49000, Chosen.OPTION)),
        (Settings("192.0.2.1"), {"host": "192.0.2.1", "port": "x"}, HEARD, ("192.0.2.1", 49007, Chosen.OPTION)),
        (Settings(), {"host": "192.0.2.6", "port": 49200}, HEARD, ("192.0.2.6", 49200, Chosen.PARAMETER)),
        (Settings(port=49300), {"host": "", "port": 49200}, HEARD, ("192.0.2.1", 49300, Chosen.BEACON)),
        (Settings(), {"host": ""}, HEARD, ("192.0.2.1", 49007, Chosen.BEACON)),
        (Settings(), {}, BeaconWatch(), ("127.0.0.1", 49000, Chosen.ASSUMED)),
    ],
)
def test_x_plane_is_found_as_the_nodes_find_it(settings, parameters, watch, expected):
    target = choose(settings, parameters, watch)
    assert (target.address, target.port, target.chosen) == expected


def test_a_computer_is_known_by_all_addresses_its_beacon_was_heard_under():
    watch = BeaconWatch(
        (
            Sighting("192.0.2.1", 49000, 115501, "lab-pc"),
            Sighting("198.51.100.1", 49000, 115501, "lab-pc"),
            Sighting("198.51.100.1", 49010, 115501, "lab-pc"),
            Sighting("198.51.100.2", 49000, 115501, "lab-pc-2"),
        )
    )
    for host, port, expected in (
        ("198.51.100.1", 49000, ("198.51.100.1", "192.0.2.1")),
        ("198.51.100.1", 49010, ("198.51.100.1",)),
        ("192.0.2.9", 49000, ("192.0.2.9",)),
    ):
        assert addresses_of(choose(Settings(host, port), {}, watch), watch) == expected


def test_a_name_without_an_address_is_said():
    target = choose(Settings("no-such-computer.invalid"), {}, HEARD)
    assert (target.address, target.host) == ("", "no-such-computer.invalid")
    assert target.error


# --------------------------------------------------------------------------------------------------------- answers


def test_what_x_plane_has_is_read_and_all_subscriptions_end(monkeypatch):
    monkeypatch.setattr(simulator, "_MORE_S", WAIT_S)  # it has all that is asked for: the last answer ends it
    on = names.BRIDGE_OVERRIDES[0]
    rows = {names.data_row(index): float(index == 20) for index in range(protocol.ROW_COUNT)}
    with FakeXPlane({**VALUES, **dict.fromkeys(names.OVERRIDES, 0.0), on: 1.0, **rows}) as xplane:
        answers = simulator.ask("127.0.0.1", xplane.port, WAIT_S)
        assert answers.values.keys() >= {*names.OVERRIDES, *rows}
        assert answers.values[names.VERSION] == 115501
        assert answers.values[FakeXPlane.TIME] > answers.first[FakeXPlane.TIME] > 10
        assert answers.values[on] == 1
        assert {row for row in rows if answers.values[row]} == {names.data_row(20)}
        assert list(answers.sources) == [("127.0.0.1", xplane.port)]
        assert not answers.refused
        wait_until(lambda: not any(xplane.subscriptions.values()), WAIT_S, "end of all subscriptions")
        assert len(xplane.subscriptions) == 2, "the asking socket, and the one that probes the port"
        assert not xplane.others, "the doctor writes nothing"


def test_requests_come_in_batches_that_one_frame_takes(monkeypatch):
    """Of more than about 148 requests in a frame X-Plane loses some."""
    batches = [0]

    class Counted(simulator.Questions):
        def _send(self, _datagram):
            batches[-1] += 1

    def sleep(duration_s):
        assert duration_s >= 1 / 20, "frames last up to 1/20 s: below that rate X-Plane slows its time"
        batches.append(0)

    monkeypatch.setattr(simulator, "time", SimpleNamespace(monotonic=time.monotonic, sleep=sleep))
    with Counted("127.0.0.1", free_udp_port()) as questions:
        questions.ask([f"sim/{number}" for number in range(250)], 0.5)
        assert batches == [100, 100, 50]


def test_answers_from_another_address_are_taken_and_reported():
    with FakeXPlane(VALUES, reply_from="127.0.0.2") as xplane:
        answers = simulator.ask("127.0.0.1", xplane.port, WAIT_S)
    assert answers.any
    assert list(answers.sources) == [("127.0.0.2", xplane.port)]


def test_it_asks_no_longer_where_it_is_to_end_and_ends_its_subscriptions():
    with FakeXPlane({}) as xplane:
        answers = simulator.ask("127.0.0.1", xplane.port, 10 * WAIT_S, lambda: any(xplane.subscriptions.values()))
        wait_until(lambda: not any(xplane.subscriptions.values()), WAIT_S, "end of all subscriptions")
    assert not answers.any


def test_nothing_listening_is_distinguished_from_silence():
    refused = simulator.ask("127.0.0.1", free_udp_port(), 0.3)
    assert (refused.any, refused.refused) == (False, True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as silent:
        silent.bind(("127.0.0.1", 0))
        answers = simulator.ask("127.0.0.1", silent.getsockname()[1], 0.3)
    assert (answers.any, answers.refused) == (False, False)


# ----------------------------------------------------------------------------------------------------------- ports


def test_the_program_that_holds_a_port_is_named(tmp_path):
    script = tmp_path / "telemetry_reader"
    script.write_text(
        "import socket\ns = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)\ns.bind(('', 0))\n"
        "print(s.getsockname()[1], flush=True)\ninput()\n",
        encoding="utf-8",
    )
    with subprocess.Popen([sys.executable, script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        port = int(other.stdout.readline())
        free = free_udp_port()
        assert ports.holders([port, free]) == {port: [ports.Holder("telemetry_reader", other.pid)], free: []}
        assert str(ports.Holder("telemetry_reader", 7)) == "telemetry_reader (process 7)"
        other.communicate("\n")


@pytest.mark.parametrize(
    ("program", "is_xplane"),
    [("X-Plane-x86_64", True), ("X-Plane", True), ("xplane_emulator", True), ("rx_node", False), ("", False)],
)
def test_x_plane_is_known_by_its_name(program, is_xplane):
    assert ports.Holder(program, 1).is_xplane is is_xplane


def test_rows_that_come_unasked_are_seen_and_taken_ports_left_alone():
    port = free_udp_port()
    packet = protocol.DataPacket(((20, (0.0,) * 8), (3, (0.0,) * 8))).encode(0x2A)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other, Repeat(("127.0.0.1", port), packet, b"DATA*"):
        other.bind(("", 0))
        taken = other.getsockname()[1]

        def watched():
            watch = data_output.watch([port, taken], 0.4)
            return watch if watch.rows else None

        watch = wait_until(watched, WAIT_S, "row in the time of the watch")
    assert watch.rows == {(port, "127.0.0.1"): (3, 20)}
    assert watch.taken == (taken,)


# -------------------------------------------------------------------------------------------------------- computer

FIB_TRIE = """Main:
  +-- 0.0.0.0/0 3 0 5
     +-- 127.0.0.0/8 2 0 2
           |-- 127.0.0.1
              /32 host LOCAL
           |-- 192.0.2.17
              /32 host LOCAL
           |-- 192.0.2.255
              /32 link BROADCAST
Local:
           |-- 192.0.2.17
              /32 host LOCAL
"""
# 172.20.80.1 in the machine's byte order (little-endian), as Linux prints it.
ROUTE = """Iface\tDestination\tGateway \tFlags\tRefCnt\tUse\tMetric\tMask
eth0\t005014AC\t00000000\t0001\t0\t0\t0\t00F0FFFF
eth0\t00000000\t015014AC\t0003\t0\t0\t0\t00000000
"""


@pytest.mark.skipif(sys.byteorder != "little", reason="the planted route is written by a little-endian machine")
def test_wsl_its_gateway_and_a_firewall_are_seen(tmp_path):
    net, ufw = tmp_path / "net", tmp_path / "etc" / "ufw"
    net.mkdir()
    ufw.mkdir(parents=True)
    (tmp_path / "version").write_text("Linux version 5.15.90.1-microsoft-standard-WSL2 (oe-user)\n", encoding="ascii")
    (net / "fib_trie").write_text(FIB_TRIE, encoding="ascii")
    (net / "route").write_text(ROUTE, encoding="ascii")
    (ufw / "ufw.conf").write_text("# on boot\nENABLED=yes\nLOGLEVEL=low\n", encoding="ascii")
    seen = computer.observe(tmp_path, tmp_path / "etc")
    assert seen.wsl
    assert seen.addresses == ("192.0.2.17",)
    assert seen.gateway == "172.20.80.1"
    assert seen.firewall == "ufw"
    (ufw / "ufw.conf").write_text("ENABLED=no\n", encoding="ascii")
    (tmp_path / "version").write_text("Linux version 6.1.0-18-amd64 (debian-kernel)\n", encoding="ascii")
    other = computer.observe(tmp_path, tmp_path / "etc")
    assert (other.wsl, other.firewall) == (False, "")


def test_own_addresses_are_distinguished_from_others():
    assert computer.is_own("127.0.0.1")
    assert not computer.is_own("192.0.2.1")  # of the block for documentation: in use nowhere
    assert computer.is_same_computer("127.0.0.1", "127.0.0.2")
    assert not computer.is_same_computer("127.0.0.1", "192.0.2.1")


# ----------------------------------------------------------------------------------------------------------- names


def test_every_dataref_exists_in_every_version():
    from xplane_bridge.xplane_names import VERSIONS, versions_with

    plain = {name.partition("[")[0] for name in (*names.BASIC, *names.OVERRIDES, names.DATA_ROWS)}
    assert {name: tuple(versions_with(name)) for name in plain} == dict.fromkeys(plain, tuple(VERSIONS))


def test_the_doctor_needs_nothing_but_python():
    from xplane_bridge import doctor

    source = os.path.dirname(os.path.dirname(os.path.dirname(doctor.__file__)))
    # Without any site-packages, that of the virtual environment and that of the system: what is imported is Python's.
    code = f"import sys; sys.path.insert(0, {source!r}); from xplane_bridge.cli.xplane_doctor import main; main(['-h'])"
    done = subprocess.run([sys.executable, "-I", "-S", "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "usage: xplane_doctor" in done.stdout
