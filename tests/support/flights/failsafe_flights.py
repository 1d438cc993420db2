"""What becomes of the emulator's aircraft when their program dies: the flights behind docs/control/failsafes.md."""

from __future__ import annotations

import copy
import math
from typing import Any, Iterator, List, NamedTuple, Optional

from xplane_bridge.compiled import require
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.command_channels import apply_channels
from xplane_bridge.emulator.flight.flight_model import FlightModel, InitialState
from xplane_bridge.in_process.aircraft import AUTO, arbiter_options

FRAME_S = 1.0 / 60.0
SECONDS = 30.0
SHIPPED = "as shipped"
#: As in the aircraft files. `manual` is `neutral` while no pilot has the stick, and that pilot's matter while one has.
KINDS = ("neutral", "hold", SHIPPED)
#: What the program commands in its last second, beyond what trimmed flight takes: stick to the right, throttle.
MOMENTS = {"steady flight": (0.0, 0.0), "rolling right": (0.5, 0.0), "throttle low": (0.0, -0.15)}
_STICK = ("roll", "pitch", "yaw")
_ALTITUDE_M = 1000.0


class Start(NamedTuple):
    """A flight that is trimmed."""

    aircraft: str  #: of the emulator, and its file's stem in config/aircraft
    phase: str
    speed_mps: Optional[float]  #: None: the aircraft's own
    room_m: float  #: how far it may leave its height in `SECONDS`: 5 m/s in flight, 2 m/s in hover


STARTS = (
    Start("fixed_wing", "cruise", None, 150.0),
    Start("multirotor", "hover", None, 60.0),
    Start("tiltrotor", "cruise", 85.0, 150.0),
    Start("tiltrotor", "hover", 0.0, 60.0),
)


class Outcome(NamedTuple):
    """A flight of `SECONDS` after its program died."""

    start: Start
    moment: str
    kind: str
    sunk_m: float  #: loss of altitude
    slowed_mps: float  #: loss of true airspeed
    bank_deg: float  #: largest
    lives: bool  #: stayed within its room, 60 degrees of bank and the speeds it is made for


def arbiter(aircraft: str, kind: str) -> Any:
    """tx_node's own, as the aircraft's file and tx.yaml make it; it misses its program at once."""
    options = copy.deepcopy(arbiter_options(aircraft))
    options.update(initial_mode=AUTO, command_timeout=FRAME_S / 2.0)
    if kind != SHIPPED:
        options["failsafe"] = kind
        for channel in options["channels"].values():
            channel.pop("failsafe", None)
    return require("the table of failsafes").ControlArbiter(options, 0.0)


def fly(start: Start, moment: str, kind: str) -> Outcome:
    """A second under its program, then what the failsafe makes of it."""
    model = create_model(start.aircraft, seed=1)
    controls = model.reset(InitialState(altitude_m=_ALTITUDE_M, airspeed_mps=start.speed_mps))
    stick, throttle = MOMENTS[moment]
    controls.roll += stick
    controls.throttle = [lever + throttle for lever in controls.throttle]
    program = {name: getattr(controls, name) for name in _STICK}
    program["throttle"] = controls.throttle[0]
    failsafe, frames = arbiter(start.aircraft, kind), round(1.0 / FRAME_S)
    for frame in range(frames):
        failsafe.command(AUTO, program, frame * FRAME_S)
        failsafe.step(frame * FRAME_S)
        model.step(FRAME_S, controls)
    begun = model.state.copy()
    bank, slowest, fastest, lowest, highest = 0.0, math.inf, 0.0, math.inf, -math.inf
    for frame in range(frames, frames + round(SECONDS / FRAME_S)):
        apply_channels(failsafe.step(frame * FRAME_S), controls, model)
        model.step(FRAME_S, controls)
        state = model.state
        bank = max(bank, abs(math.degrees(state.roll_rad)))
        slowest, fastest = min(slowest, state.true_airspeed_mps), max(fastest, state.true_airspeed_mps)
        lowest, highest = min(lowest, state.altitude_m), max(highest, state.altitude_m)
    strayed = max(begun.altitude_m - lowest, highest - begun.altitude_m)
    flew = strayed <= start.room_m and bank <= 60.0
    lives = flew and _slowest_allowed(model, start) <= slowest and fastest <= model.info.never_exceed_mps
    end = model.state
    sunk, slowed = begun.altitude_m - end.altitude_m, begun.true_airspeed_mps - end.true_airspeed_mps
    return Outcome(start, moment, kind, sunk, slowed, bank, lives)


def _slowest_allowed(model: FlightModel, start: Start) -> float:
    return 0.0 if start.phase == "hover" else model.info.stall_mps


def outcomes() -> Iterator[Outcome]:
    """All of them, in the order of the table."""
    for start in STARTS:
        for moment in MOMENTS:
            for kind in KINDS:
                yield fly(start, moment, kind)


def table(flown: List[Outcome]) -> str:
    """docs/control/failsafes.md's table."""
    lines = [
        "| aircraft | program dies in | failsafe | altitude lost | speed lost | largest bank | lives |",
        "|---|---|---|---|---|---|---|",
    ]
    return "\n".join(lines + [_line(outcome) for outcome in flown])


def _line(outcome: Outcome) -> str:
    cells: List[Any] = [f"{outcome.start.aircraft}, {outcome.start.phase}", outcome.moment]
    cells.append(f"**{outcome.kind}**" if outcome.kind == SHIPPED else f"`{outcome.kind}`")
    cells += [f"{outcome.sunk_m + 0.0:.0f} m", f"{outcome.slowed_mps + 0.0:.0f} m/s", f"{outcome.bank_deg:.0f}°"]
    cells.append("yes" if outcome.lives else "**no**")
    return f"| {' | '.join(cells)} |".replace("-0 ", "0 ")
