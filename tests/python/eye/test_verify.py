"""The printed time: read whatever the font, over scenery that moves; a picture that is one frame off is found."""

from __future__ import annotations

import math
import threading
from pathlib import Path
from typing import List, Optional, Tuple

import cv2
import numpy as np
import pytest

from xplane_bridge.eye import calibrate
from xplane_bridge.eye import screen as screen_module
from xplane_bridge.eye.calibrate import UndoFile
from xplane_bridge.eye.pairing import Decision, Frame
from xplane_bridge.eye.screen import ScreenError, TimesOnScreen
from xplane_bridge.eye.verify import Findings, Verification, VerifyError

PERIOD = 1.0 / 30.0
#: Of X-Plane's time when it begins: the hundreds change meanwhile.
START = 585.3
FONTS = {
    "simplex": (cv2.FONT_HERSHEY_SIMPLEX, 0.5, 1),
    "plain": (cv2.FONT_HERSHEY_PLAIN, 1.0, 1),
    "large": (cv2.FONT_HERSHEY_DUPLEX, 0.9, 2),
    "serifs": (cv2.FONT_HERSHEY_COMPLEX, 0.6, 1),
}


class Scenery:
    """Pictures of moving scenery with numbers on it."""

    def __init__(self, font: str = "simplex", form: str = "{:.2f}") -> None:
        self._font, self._form = FONTS[font], form
        draw = np.random.default_rng(3)
        coarse = draw.integers(60, 150, (60, 90)).astype(np.uint8)
        self._ground = cv2.resize(coarse, (1440, 960), interpolation=cv2.INTER_CUBIC)

    def picture(self, time: Optional[float], k: int) -> np.ndarray:
        left, top = int(300 + 250 * np.sin(0.013 * k)), int(300 + 250 * np.cos(0.007 * k))
        pixels = np.repeat(self._ground[top : top + 240, left : left + 320, np.newaxis], 4, axis=2)
        if time is not None:
            face, scale, thickness = self._font
            # Another number that changes: the time of the flight, which began later.
            for value, at in ((time - 371.64, (10, 60)), (time, (10, 30)), (0.5, (10, 90))):
                cv2.putText(
                    pixels, self._form.format(value), at, face, scale, (250, 250, 250, 0), thickness, cv2.LINE_AA
                )
        return pixels


def verified(
    scenery: Scenery,
    stills: int = 60,
    wrong: Tuple[int, ...] = (),
    shift: int = 0,
    flags: int = 0,
    blank: bool = False,
    start: float = START,
) -> Tuple[Findings, List[str]]:
    """The findings for pictures that show frames `shift` later than said, and those counted in `wrong` one more."""
    said: List[str] = []
    verification = Verification(said.append, stills)
    reading_from = None
    for k in range(3000):
        verification.add_frame(Frame(0, float(np.float32(start + k * PERIOD)), k))
        verification.work()
        if verification.finished:
            break
        if k < 20:
            continue
        if said and reading_from is None:
            reading_from = k
        index = k - 18
        off = shift + (reading_from is not None and k - reading_from in wrong)
        shown = None if blank else float(np.float32(start + (index + off) * PERIOD))
        frame = Frame(0, float(np.float32(start + index * PERIOD)), index)
        verification.offer(Decision(scenery.picture(shown, k), 0, frame, 0.1, 0.0, flags))
    assert verification.findings is not None
    return verification.findings, said


@pytest.mark.parametrize("font", list(FONTS))
def test_the_time_is_read_in_any_font(font: str) -> None:
    found, _ = verified(Scenery(font))
    assert found.decimals == 2
    assert found.unreadable <= 6
    assert found.off == {0: len(found.stills)}
    assert found.of_no_frame == 0
    assert found.good
    assert found.lines()[0].endswith("stills show the frame that they are paired with")


@pytest.mark.parametrize("start", [2.0, 96.0, 965.0])
def test_another_number_of_digits_is_learnt_anew(start: float) -> None:
    found, _ = verified(Scenery(), start=start)
    assert found.off == {0: len(found.stills)}
    assert len(found.stills) > 50


def test_one_picture_that_is_one_frame_off_is_found() -> None:
    found, _ = verified(Scenery(), wrong=(20,))
    assert (found.off[1], len(found.off)) == (1, 2)
    assert "1 show a frame 1 later than the one that they are paired with" in found.lines()


def test_a_delay_that_is_wrong_by_a_frame_is_found() -> None:
    found, _ = verified(Scenery(), shift=-1)
    assert found.off == {-1: len(found.stills)}
    assert not found.good
    assert f"{len(found.stills)} show a frame 1 earlier than the one that they are paired with" in found.lines()
    assert f"unflagged: 0 of {len(found.stills)}" in found.lines()


def test_flagged_pictures_promise_nothing() -> None:
    found, _ = verified(Scenery(), flags=8192)
    assert found.unflagged == []
    assert not found.good


def test_too_few_decimals_are_said() -> None:
    found, _ = verified(Scenery(form="{:.1f}"))
    assert found.decimals == 1
    assert found.off == {0: len(found.stills)}
    assert any("fit their frame and its neighbours alike" in line for line in found.lines())


def test_decimals_that_are_cut_off_are_known() -> None:
    class Cut(Scenery):
        def picture(self, time: Optional[float], k: int) -> np.ndarray:
            return super().picture(None if time is None else np.floor(time * 100.0) / 100.0 + 1e-6, k)

    found, _ = verified(Cut())
    assert found.off == {0: len(found.stills)}
    assert found.of_no_frame == 0


def test_no_printed_time_is_said() -> None:
    with pytest.raises(VerifyError, match="total_running_time_sec"):
        verified(Scenery(), blank=True)


class Screen:
    """X-Plane's setting: 1 while it prints its times."""

    def __init__(self, value: float = 0.0, takes: bool = True) -> None:
        self.value, self.takes = value, takes
        self.written: List[float] = []

    def write(self, path: str, value: float) -> None:
        assert path == "sim/network/dataout/data_to_screen[1]"
        self.written.append(value)
        if self.takes:
            self.value = value

    def times(self, path: Path) -> TimesOnScreen:
        undo = UndoFile(path, "here:49000", "times_on_screen", "what X-Plane prints")
        return TimesOnScreen(self.write, lambda: self.value, undo)


def test_the_times_are_printed_for_a_while(tmp_path: Path) -> None:
    screen, path = Screen(), tmp_path / "undo.json"
    with screen.times(path):
        assert screen.value == 1.0
        assert path.exists()
    assert screen.value == 0.0
    assert not path.exists()


def test_the_times_go_with_an_interrupted_run_and_with_the_start_after_a_killed_one(tmp_path: Path) -> None:
    screen, path = Screen(), tmp_path / "undo.json"
    with pytest.raises(KeyboardInterrupt), screen.times(path):
        raise KeyboardInterrupt
    assert screen.value == 0.0
    screen.times(path).__enter__()
    assert screen.value == 1.0
    screen.times(path).restore()
    assert screen.value == 0.0
    assert not path.exists()


def test_times_that_the_user_wants_to_see_stay(tmp_path: Path) -> None:
    screen = Screen(1.0)
    with screen.times(tmp_path / "undo.json"):
        pass
    assert screen.written == []
    assert screen.value == 1.0


def test_what_x_plane_prints_is_waited_for_as_its_first_answers_come_one_by_one(tmp_path: Path) -> None:
    screen = Screen(math.nan)
    answer = threading.Timer(0.2, setattr, (screen, "value", 0.0))
    answer.start()
    with screen.times(tmp_path / "undo.json"):
        assert screen.value == 1.0
    assert screen.value == 0.0


@pytest.mark.parametrize("value", [0.0, float("nan")])
def test_an_x_plane_that_does_not_print_is_said(value: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(calibrate, "_WRITE_TIMEOUT_S", 0.05)
    monkeypatch.setattr(screen_module, "_HEARD_WITHIN_S", 0.05)
    path = tmp_path / "undo.json"
    with pytest.raises(ScreenError, match="tick row 1"):
        Screen(value, takes=False).times(path).__enter__()
    assert not path.exists()
