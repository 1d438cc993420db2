"""What programs do alike: values that begin with a minus, as they are typed."""

from __future__ import annotations

from typing import Any, List

import pytest

from xplane_bridge.cli import xplane_emulator
from xplane_bridge.cli.entry import with_values_below_zero
from xplane_bridge.cli.sight import xplane_eye
from xplane_bridge.emulator.options import Options


def test_the_emulator_takes_southern_aerodromes_and_windows_that_look_left() -> None:
    asked: List[Options] = []

    def make(options: Options) -> Any:
        asked.append(options)
        raise OSError("it need not run")

    view = ["--window", "--window2", "-30/-20", "--aerodrome", "-33.9,151.2,160"]
    assert xplane_emulator.main(view, make) == 1
    assert asked[0].aerodrome == (-33.9, 151.2, 160.0)
    assert [(window.heading_deg, window.pitch_deg) for window in asked[0].more_windows] == [(-30.0, -20.0)]


def test_the_eye_takes_windows_left_of_the_main_monitor(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: List[Any] = []

    class Started:
        findings = None

        def __init__(self, options: Any, _say: Any) -> None:
            asked.append(options)

        def run(self) -> None:
            pass

    monkeypatch.setattr(xplane_eye, "Eye", Started)
    assert xplane_eye.main(["127.0.0.1:49790", "--window", "-1920,0", "--delay", "-1e-3"]) == 0
    assert (asked[0].window, asked[0].delay_s) == ((-1920, 0), -0.001)


def test_other_arguments_stay_as_they_are() -> None:
    for arguments in (
        ["-3"],
        ["--", "-3"],
        ["--hud", "-v"],
        ["--hud", "--no-strip"],
        ["--lat=-33.9", "-3"],
        ["-v", "-3"],
        ["--name", "a"],
    ):
        assert with_values_below_zero(arguments) == arguments
