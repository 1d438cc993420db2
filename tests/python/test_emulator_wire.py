"""The emulator on the wire: what X-Plane answers, to whom, when, also where that is unfriendly."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from xplane_bridge import protocol

sys.path.insert(0, str(Path(__file__).parent))
from emulator_client import Bench  # noqa: E402

THETA = "sim/flightmodel/position/theta"
LATITUDE = "sim/flightmodel/position/latitude"
TIME = "sim/time/total_running_time_sec"


@pytest.fixture
def bench():
    benches = []

    def make(**options):
        benches.append(Bench(**options))
        return benches[-1]

    yield make
    for one in benches:
        one.close()


def test_rref_gives_all_values_of_a_frame_in_one_datagram(bench):
    emulator = bench(fps=60.0)
    client = emulator.client()
    client.subscribe([TIME, LATITUDE, THETA])
    emulator.step(3)
    packets = client.received()
    assert len(packets) == 3
    assert all(len(packet) == 5 + 8 * 3 and packet[:5] == b"RREF," for packet in packets)
    assert [round(dict(protocol.decode_rref_response(p))[0] * 60) for p in packets] == [1, 2, 3]
