"""Which X-Plane the card flies: the one that the nodes would take, and none that a node flies already."""

from __future__ import annotations

import json
import os
import socket
from pathlib import Path

import pytest

from xplane_bridge.doctor.conformance import card, program
from xplane_bridge.doctor.observe.beacons import BeaconWatch, Sighting
from xplane_bridge.doctor.observe.journals import boot_id, process_status
from xplane_bridge.doctor.observe.ros import RosFacts
from xplane_bridge.doctor.settings import Settings

OWN = ("127.", "198.51.100.")
HERE = Sighting("198.51.100.7", 49000, 122015, "my-pc")
ONE = Sighting("192.0.2.1", 49000, 122015, "lab-pc-1")
OTHER = Sighting("192.0.2.2", 49010, 115501, "lab-pc-2")


@pytest.fixture(name="asked")
def fixture_asked(monkeypatch, tmp_path):
    """Runs the card up to where it flies: its exit code, and what it would fly. What is heard and set is given."""

    def ask(settings, heard=(), parameters=None, flies=True):
        flown = []

        def fly(address, port, *_):
            flown.append((address, port))
            raise card.CannotRunError("not flown in this test")

        def observe(environment, namespace):
            assert (environment["ROS_HOME"], namespace) == (str(tmp_path), "/lab")
            return RosFacts(parameters=parameters or {})

        root = "xplane_bridge.doctor.observe"
        monkeypatch.setattr(f"{root}.beacons.listen", lambda *_: BeaconWatch(tuple(heard), ("eth0",)))
        monkeypatch.setattr(f"{root}.ros.observe", observe)
        monkeypatch.setattr(f"{root}.computer.is_own", lambda address: address.startswith(OWN))
        monkeypatch.setattr(f"{root}.target.is_own", lambda address: address.startswith(OWN))
        if flies:
            monkeypatch.setattr(card, "fly", fly)
        more = {"environment": {"ROS_HOME": str(tmp_path)}, "namespace": "/lab"}
        code = program.main(Settings(**settings, **more), ["vehs"], True)
        return code, flown

    return ask


def test_it_asks_which_one_where_several_announce_themselves(asked, capsys):
    assert asked({}, [OTHER, ONE]) == (2, [])
    said = capsys.readouterr().err
    assert "2 X-Planes announce themselves: lab-pc-2 (192.0.2.2) port 49010 (version 11.55 (115501)), lab-pc-1" in said
    assert "--host and --port" in said


def test_a_port_alone_names_none_of_several_as_the_nodes_have_it(asked):
    assert asked({"port": 49010}, [OTHER, ONE]) == (2, [])


@pytest.mark.parametrize(
    ("settings", "heard", "parameters", "expected"),
    [
        ({}, [ONE], {}, ("192.0.2.1", 49000)),
        ({}, [OTHER, ONE], {"host": "192.0.2.1"}, ("192.0.2.1", 49000)),
        ({}, [HERE], {"host": "127.0.0.1"}, ("127.0.0.1", 49000)),
        ({}, [HERE], {"host": "127.0.0.1", "port": 49020}, ("127.0.0.1", 49020)),
        ({"host": "192.0.2.2"}, [ONE, OTHER], {"host": "192.0.2.1"}, ("192.0.2.2", 49010)),
        ({"host": "127.0.0.1"}, [], {"host": "localhost", "port": 49020}, ("127.0.0.1", 49020)),
        ({"host": "192.0.2.2", "port": 49000}, [ONE, OTHER], {}, ("192.0.2.2", 49000)),
        ({"host": "127.0.0.1", "port": 49030}, [ONE, OTHER], {"port": 49020}, ("127.0.0.1", 49030)),
    ],
)
def test_it_flies_the_one_that_the_nodes_take(asked, settings, heard, parameters, expected):
    assert asked(settings, heard, parameters) == (2, [expected])


@pytest.mark.parametrize(
    ("noted", "heard"),
    [("127.0.0.1", [HERE]), ("192.0.2.9", [ONE, Sighting("192.0.2.9", ONE.port, ONE.version, ONE.computer)])],
)
def test_it_flies_none_that_a_node_holds_by_another_address(asked, capsys, tmp_path, noted, heard):
    proc, pid = Path("/proc"), os.getppid()
    owner = {"node": "/lab/tx_node", "pid": pid, "start_ticks": process_status(proc, str(pid))[1]}
    owner.update(boot_id=boot_id(proc), computer=socket.gethostname())
    entries = [{"id": "override:x", "purpose": "override", "owner": owner, "undo": []}]
    file = tmp_path / "xplane_bridge" / f"{noted}_49000.json"
    file.parent.mkdir()
    file.write_text(json.dumps({"format": "xplane_bridge journal", "version": 1, "entries": entries}), "utf-8")
    assert asked({}, heard, flies=False) == (2, [])
    assert (
        f"/lab/tx_node (process {pid} on {socket.gethostname()}) holds {file}: end it first" in capsys.readouterr().err
    )
