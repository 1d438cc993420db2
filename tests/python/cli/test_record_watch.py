"""When record_watch warns, and when it takes that back."""

from __future__ import annotations

from xplane_bridge.cli import record_watch
from xplane_bridge.cli.record_watch import StateWatch


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
