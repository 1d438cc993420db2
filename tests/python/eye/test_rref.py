"""What the eye hears of X-Plane's frames."""

from __future__ import annotations

import math
from typing import Tuple

import pytest

from support.deadlines import WAIT_S
from support.simulator.fake_xplane import FakeXPlane
from xplane_bridge import protocol
from xplane_bridge.eye import names, rref
from xplane_bridge.harness import wait_until

VALUES = {FakeXPlane.TIME: 10.0, names.FIELD_OF_VIEW: 65.0, names.TIMES_ON_SCREEN: 0.0}


class Lossy(FakeXPlane):
    """Does not get the first request for one dataref."""

    def __init__(self, lost: str) -> None:
        super().__init__(VALUES)
        self._lost = lost
        self.requests: list[str] = []

    def _take(self, datagram: bytes, client: Tuple[str, int]) -> None:
        request = protocol.decode_request(datagram)
        if isinstance(request, protocol.RrefRequest) and request.rate_hz:
            self.requests.append(request.path)
            if self.requests.count(self._lost) == 1 and request.path == self._lost:
                return
        super()._take(datagram, client)


@pytest.mark.parametrize("lost", list(VALUES))
def test_what_a_lost_request_did_not_bring_is_asked_for_again(monkeypatch, lost):
    monkeypatch.setattr(rref, "_LACKS_S", 0.1)
    heard: list[rref.Heard] = []

    def everything() -> bool:
        return bool(heard) and math.isfinite(heard[-1].field_of_view_deg + heard[-1].times_on_screen)

    with Lossy(lost) as xplane:
        with rref.FrameStream(("127.0.0.1", xplane.port), 0, heard.append):
            wait_until(everything, WAIT_S, f"{lost} in the frames")
            asked, frames = len(xplane.requests), len(heard)
            wait_until(lambda: len(heard) > frames + 5, WAIT_S, "five more frames")
            assert len(xplane.requests) == asked, "what comes is not asked for again"
        wait_until(lambda: not any(xplane.subscriptions.values()), WAIT_S, "end of the subscriptions")
    assert heard[-1].field_of_view_deg == 65.0
    assert xplane.requests.count(lost) >= 2
