"""When record_watch warns, and when it takes that back."""

from __future__ import annotations

from xplane_bridge.cli import record_watch
from xplane_bridge.cli.bridge.waiting import Surroundings
from xplane_bridge.cli.record_watch import CameraWatch, StateWatch


class Reporter:
    """Stands for the patience that would speak by the clock."""

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.spoken = False

    def look(self) -> None:
        self.calls.append("look")

    def restart(self) -> None:
        self.calls.append("restart")

    def forget(self) -> None:
        self.calls.append("forget")
        self.spoken = False


def test_it_waits_while_nothing_new_comes_and_takes_a_warning_back() -> None:
    patience, said = Reporter(), []
    watch = StateWatch(patience, said.append)
    first, second = object(), object()
    for newest in (None, None, first, first):
        watch.look(newest)
    assert patience.calls == ["look", "look", "restart", "look"]
    assert said == []
    patience.spoken = True
    watch.look(second)
    watch.look(second)
    assert patience.calls[4:] == ["restart", "forget", "look"]
    assert said == ["flight states are recorded now"]


def test_in_lockstep_it_leaves_the_watching_to_tx_node(monkeypatch) -> None:
    """There every frame would wake it; tx_node names the node that keeps a frame waiting."""
    monkeypatch.setattr(record_watch, "start_node", lambda *_args, **_options: None)
    monkeypatch.setattr(record_watch.lockstep, "is_on", lambda namespace: namespace == "/there")
    assert record_watch.main(["--namespace", "/there/"]) == 0


def seen(publishers: list[str], recorded: list[str]) -> Surroundings:
    return Surroundings(
        {topic: ["/node"] for topic in publishers}, {}, [], {topic: ["/x/rviz", "/x/record"] for topic in recorded}
    )


def test_cameras_that_run_and_are_not_recorded_are_named_once() -> None:
    said: list[str] = []
    watch = CameraWatch("/x", said.append)
    own, belly, tail = (f"/x/{name}camera/frame_state" for name in ("", "belly/", "tail/"))
    watch.look(None)
    watch.look(seen([own, belly, tail], [own, belly, tail]))
    watch.look(seen([own, belly], []))  # a recording without pictures, or one that has not begun
    assert said == []
    others = [
        "/y/belly/camera/frame_state",
        "/x/second/camera/frame_state",
        "/x/second/flight_state",
        "/x/camera/other",
    ]
    for _ in range(2):
        watch.look(seen([own, belly, tail, *others], [own, tail]))
    assert said == ["camera belly is not recorded: record.launch takes it with cameras:=belly"]
