"""Further windows of the emulator: what their option takes."""

from __future__ import annotations

import pytest

from xplane_bridge.emulator.options import parse
from xplane_bridge.emulator.windows import WindowView


@pytest.mark.parametrize(
    ("text", "view"),
    [
        ("down", WindowView(0.0, -90.0)),
        ("rear", WindowView(180.0, 0.0)),
        ("left@45", WindowView(-90.0, 0.0, 0.0, 45.0)),
        ("30/-20", WindowView(30.0, -20.0)),
        ("30/-20/5@90", WindowView(30.0, -20.0, 5.0, 90.0)),
    ],
)
def test_views_are_read(text: str, view: WindowView) -> None:
    assert parse(["--window", f"--window2={text}"]).more_windows == (view,)


def test_several_and_none() -> None:
    assert parse(["--window", "--window2", "down", "--window2", "left"]).more_windows == (
        WindowView(0.0, -90.0),
        WindowView(-90.0, 0.0),
    )
    assert parse(["--window"]).more_windows == ()


@pytest.mark.parametrize("text", ["up", "30", "30/x", "1/2/3/4", "nan/0", "down@", "down@180", "down@x", "270/0"])
def test_others_are_refused_in_words(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parse(["--window", f"--window2={text}"])
    said = capsys.readouterr().err
    assert f"--window2: {text}: expected one of" in said
    assert "HEADING/PITCH" in said


def test_none_without_the_first(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parse(["--window2", "down"])
    assert "--window with it" in capsys.readouterr().err
