"""The delay from steps of the field of view; X-Plane is a few lines here, with its own times."""

from __future__ import annotations

import json
import os
import random
import sys
import tempfile
import threading
import types
from pathlib import Path
from typing import List

import numpy as np
import pytest

from xplane_bridge.eye import calibrate
from xplane_bridge.eye.calibrate import Calibration, CalibrationError, UndoFile, settle

PERIOD_NS = 20_000_000


def recording(delay_ns: int, seed: int = 1, unseen: int = 0) -> tuple:
    """Ten steps at random frames, and the differences between pictures; `unseen` steps do not show."""
    draw = random.Random(seed)
    steps, at = [], 20
    for _ in range(10):
        at += draw.randint(8, 15)
        steps.append(at)
    frames, pictures, angle = [], [], 60.0
    for number in range(at + 40):
        zooms = number in steps
        angle += 0.0 if not zooms else (8.0 if steps.index(number) % 2 == 0 else -8.0)
        seen = zooms and steps.index(number) >= unseen
        frames.append((number * PERIOD_NS, angle))
        pictures.append((number * PERIOD_NS + delay_ns, 20.0 if seen else draw.uniform(0.5, 2.0)))
    return frames, pictures


@pytest.mark.parametrize("delay_ns", [0, 5_000_000, 40_000_000, 58_000_000, 200_000_000, 380_000_000])
def test_regular_frames_do_not_hide_whole_periods(delay_ns: int):
    found = settle(*recording(delay_ns))
    assert found.delay_s == pytest.approx(1e-9 * delay_ns, abs=1e-9)
    assert (found.steps, found.spread_s) == (10, 0.0)


def test_no_result_lies_beyond_what_delay_takes():
    """One step at -20 ms, and nine at -24 ms, within half a frame of it."""
    frames, pictures = recording(-24_000_000)
    first = next(place for place, (_, difference) in enumerate(pictures) if difference == 20.0)
    pictures[first] = (pictures[first][0] + 4_000_000, 20.0)
    assert settle(frames, pictures).delay_s == -0.02


def test_steps_that_were_missed_do_no_harm_and_too_many_are_said():
    assert settle(*recording(58_000_000, unseen=4)).delay_s == pytest.approx(0.058, abs=1e-9)
    with pytest.raises(CalibrationError, match="were seen in the pictures"):
        settle(*recording(58_000_000, unseen=9))


def test_a_view_that_moves_much_hides_no_steps():
    frames, pictures = recording(58_000_000)
    moving = [(change, 20.0 if difference == 20.0 else 9.5 + 0.1 * (change % 7)) for change, difference in pictures]
    assert settle(frames, moving).delay_s == pytest.approx(0.058, abs=1e-9)


def test_steps_that_fit_several_delays_are_no_measurement():
    """Ten steps at equal times: nine of them fit a delay that is one step longer."""
    steps = range(20, 120, 10)
    frames = [(number * PERIOD_NS, 60.0 + 8.0 * (sum(step <= number for step in steps) % 2)) for number in range(160)]
    pictures = [(number * PERIOD_NS, 20.0 if number in steps else 1.0) for number in range(160)]
    with pytest.raises(CalibrationError, match=r"more than one delay \(10 and 9 of 10\)"):
        settle(frames, pictures)


def test_an_x_plane_that_does_not_change_its_view_is_said():
    frames, pictures = recording(0)
    with pytest.raises(CalibrationError, match=r"reports 0 of 10 steps.*--delay"):
        settle([(arrival, 60.0) for arrival, _ in frames], pictures)


def test_a_still_picture_has_no_steps():
    assert calibrate.step_pictures([(number, 0.0) for number in range(50)], 10) == []


def test_small_grey_is_the_picture_in_small():
    picture = np.zeros((480, 640, 4), np.uint8)
    picture[:, 320:, 1] = 200
    small = calibrate.small_grey(picture)
    assert small.shape == (56, 80)
    assert small[:, :39].max() == 0
    assert small[:, 41:].min() == 200


class Simulator:
    """Takes a field of view as X-Plane does, or refuses; time passes when it is waited for."""

    def __init__(self, takes: bool = True) -> None:
        self.value = 71.0
        self.takes = takes
        self.written: list = []

    def write(self, path: str, value: float) -> None:
        assert path == "sim/graphics/view/field_of_view_deg"
        self.written.append(value)
        if self.takes:
            self.value = value


def make(simulator: Simulator, path: Path, wait=lambda _: None) -> Calibration:
    return Calibration(simulator.write, lambda: simulator.value, UndoFile(path, "here:49000"), wait)


def test_the_field_of_view_is_kept_before_it_is_changed_and_given_back(tmp_path: Path):
    path = tmp_path / "new" / "undo.json"
    simulator = Simulator()
    kept = []
    calibration = make(simulator, path, lambda _: kept.append(json.loads(path.read_text(encoding="utf-8"))))
    with pytest.raises(CalibrationError, match="reports 0"):  # nothing is seen: no frames come here
        calibration.run()
    assert set(map(str, kept)) == {str({"xplane": "here:49000", "field_of_view_deg": 71.0})}
    assert {71.0, 79.0} == set(simulator.written)
    assert simulator.value == 71.0
    assert not path.exists()


def test_ctrl_c_in_the_middle_gives_it_back(tmp_path: Path):
    simulator = Simulator()

    def interrupt(_: float) -> None:
        if simulator.value == 79.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make(simulator, tmp_path / "undo.json", interrupt).run()
    assert simulator.value == 71.0
    assert os.listdir(tmp_path) == []


def test_the_next_start_gives_back_what_a_killed_one_has_left(tmp_path: Path):
    path = tmp_path / "undo.json"
    UndoFile(path, "here:49000").keep(71.0)
    simulator = Simulator()
    simulator.value = 79.0
    make(simulator, path).restore()
    assert simulator.value == 71.0
    assert not path.exists()


def test_another_x_planes_value_is_left_alone(tmp_path: Path):
    path = tmp_path / "undo.json"
    UndoFile(path, "elsewhere:49000").keep(50.0)
    simulator = Simulator()
    make(simulator, path).restore()
    assert simulator.written == []
    assert path.exists()


def test_nothing_is_changed_that_could_not_be_restored(tmp_path: Path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    simulator = Simulator()
    with pytest.raises(CalibrationError, match="cannot be written"):
        make(simulator, tmp_path / "file" / "undo.json").run()
    assert simulator.written == []


def test_what_x_plane_does_not_take_back_stays_noted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(calibrate, "_WRITE_TIMEOUT_S", 0.05)
    path = tmp_path / "undo.json"
    UndoFile(path, "here:49000").keep(50.0)
    with pytest.raises(CalibrationError, match="stays noted"):
        make(Simulator(takes=False), path).restore()
    assert path.exists()


def test_an_x_plane_that_does_not_say_its_field_of_view_is_left_alone(tmp_path: Path):
    simulator = Simulator()
    simulator.value = float("nan")
    with pytest.raises(CalibrationError, match="does not say"):
        make(simulator, tmp_path / "undo.json").run()
    assert simulator.written == []


def test_of_two_eyes_that_start_at_once_the_second_sees_the_users_own_value(tmp_path: Path):
    simulator = Simulator()
    seen: List[float] = []
    other = Calibration(
        simulator.write,
        lambda: seen.append(simulator.value) or simulator.value,
        UndoFile(tmp_path / "other.json", "here:49000"),
        lambda _: None,
    )

    def run_other() -> None:
        with pytest.raises(CalibrationError, match="reports 0"):
            other.run()

    thread = threading.Thread(target=run_other)

    def start_other(_: float) -> None:
        if simulator.value == 79.0 and thread.ident is None:
            thread.start()
            thread.join(0.3)

    with pytest.raises(CalibrationError, match="reports 0"):
        make(simulator, tmp_path / "undo.json", start_other).run()
    thread.join(20.0)
    assert seen[0] == 71.0
    assert simulator.value == 71.0


def test_an_eye_that_keeps_the_field_of_view_for_long_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(calibrate, "_ALONE_WITHIN_S", 0.2)
    simulator = Simulator()
    with calibrate.alone_with("elsewhere:49000"), pytest.raises(CalibrationError, match="reports 0"):
        make(simulator, tmp_path / "undo.json").run()
    simulator.written.clear()
    with calibrate.alone_with("here:49000"), pytest.raises(CalibrationError, match=r"another .* for 0.2 s .* end it"):
        make(simulator, tmp_path / "undo.json").run()
    assert simulator.written == []
    with calibrate.alone_with("here:49000"):
        pass


def test_on_windows_the_same_is_kept_by_its_own_way_of_locking(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    refusals = [PermissionError(13, "Permission denied")]

    def locking(_file: int, mode: int, length: int) -> None:
        assert (mode, length) == (2, 1)
        if refusals:
            raise refusals.pop()

    monkeypatch.setitem(sys.modules, "msvcrt", types.SimpleNamespace(LK_NBLCK=2, locking=locking))
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    with calibrate.alone_with("here:49000"):
        assert refusals == []
    assert (tmp_path / "xplane_bridge" / "eye_here_49000.lock").is_file()


def test_where_the_home_folder_cannot_be_written_eyes_know_of_each_other_by_a_temporary_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(calibrate, "_ALONE_WITHIN_S", 0.2)
    simulator = Simulator()
    with calibrate.alone_with("here:49000"), pytest.raises(
        CalibrationError, match=r"another .*xplane_bridge_\d+/eye_h"
    ):
        make(simulator, tmp_path / "undo.json").run()
    assert simulator.written == []
    with pytest.raises(CalibrationError, match="reports 0"):
        make(simulator, tmp_path / "undo.json").run()


def test_where_eyes_cannot_know_of_each_other_nothing_is_changed_and_what_was_is_given_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "file"))
    path = tmp_path / "undo.json"
    simulator = Simulator()
    with pytest.raises(CalibrationError, match=r"cannot be locked .*, .*cannot be locked .* left alone"):
        make(simulator, path).run()
    assert simulator.written == []
    UndoFile(path, "here:49000").keep(71.0)
    simulator.value = 79.0
    make(simulator, path).restore()
    assert simulator.value == 71.0
    assert not path.exists()


def test_what_speaks_against_it_is_asked_when_no_other_eye_measures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(calibrate, "_ALONE_WITHIN_S", 0.0)
    simulator = Simulator()

    def why_not() -> str:
        with pytest.raises(CalibrationError, match="another"), calibrate.alone_with("here:49000"):
            pass
        return "it is being recorded"

    with pytest.raises(CalibrationError, match="it is being recorded"):
        make(simulator, tmp_path / "undo.json").run(why_not)
    assert simulator.written == []


def test_the_steps_of_another_eye_that_was_waited_for_are_not_taken_for_its_own(tmp_path: Path):
    calibration = make(Simulator(), tmp_path / "undo.json")
    for frame in recording(58_000_000)[0]:
        calibration.add_frame(*frame)
    with pytest.raises(CalibrationError, match="reports 0"):
        calibration.run()


def test_ctrl_c_ends_it_also_where_x_plane_does_not_take_its_value_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(calibrate, "_WRITE_TIMEOUT_S", 0.05)
    simulator = Simulator()

    def interrupt(_: float) -> None:
        if simulator.value == 79.0:
            simulator.takes = False
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make(simulator, tmp_path / "undo.json", interrupt).run()
    assert UndoFile(tmp_path / "undo.json", "here:49000").kept() == 71.0
