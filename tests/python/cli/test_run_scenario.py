"""run_scenario: what it starts for its command line."""

from __future__ import annotations

import pytest

from xplane_bridge.cli.run_scenario import lockstep_of, parser
from xplane_bridge.scenario import ScenarioError


@pytest.mark.parametrize(
    ("options", "fps"),
    [("", 60.0), ("--fps 30", 30.0), ("--fps=24 --seed 3", 24.0), ("--turbulence 1 --fps 30 --fps 50", 50.0)],
)
def test_lockstep_goes_by_the_emulators_frames(options, fps):
    lockstep = lockstep_of(parser().parse_args(["demo", "--lockstep", f"--emulator={options}"]))
    assert lockstep is not None
    assert lockstep.fps == fps


def test_frames_a_second_that_are_none_are_refused(capsys):
    with pytest.raises(SystemExit):
        lockstep_of(parser().parse_args(["demo", "--lockstep", "--emulator=--fps=none"]))
    assert "run_scenario --emulator: error: argument --fps: " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--speed", "2"], "--speed 2.0: needs --lockstep"),
        (["--controller-node", "law"], "--controller-node law: needs --lockstep"),
        (["--lockstep", "--transport", "data"], "--lockstep flies with --transport rref"),
    ],
)
def test_options_that_do_not_go_together_are_refused(arguments, said):
    with pytest.raises(ScenarioError, match=said):
        lockstep_of(parser().parse_args(["demo", *arguments]))
