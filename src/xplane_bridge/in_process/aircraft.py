"""The emulator's flight model behind tx_node's arbiter.

It flies as the bridge does: what is commanded from the state of frame k flies in frame k + 1, numbers are float32 where
they go over the wire, and limits, failsafes, mode and take-over are those of the arbiter, with the options of
config/tx.yaml and config/aircraft/<name>.yaml.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Dict, Mapping, Optional, Tuple

import yaml

from xplane_bridge.compiled import require
from xplane_bridge.constants import FlightMode
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.command_channels import TrimsOnChange, apply_channels
from xplane_bridge.emulator.flight.earth import LocalFrame
from xplane_bridge.emulator.flight.flight_model import FlightModel, InitialState, ModelState
from xplane_bridge.emulator.flight.limits import check_wind
from xplane_bridge.emulator.scenario_pilot import START
from xplane_bridge.in_process.failures import Failures
from xplane_bridge.in_process.view import FlightView
from xplane_bridge.resources import config_file

#: As plain numbers, which results and files hold.
MANUAL, AUTO = int(FlightMode.MANUAL), int(FlightMode.AUTO)
#: Keys of the weather and of the loading, as scenarios and campaigns have them; those of a start are `START`.
WEATHER = ("wind_speed", "wind_from", "turbulence", "temperature_offset", "sea_level_pressure")
LOADING = ("fuel", "payload", "cg_aft")
#: Where tx_node's clock stands when a flight in lock-step begins [ns], but for whole seconds that change no difference.
_CLOCK_NS = 2**20 * 10**9


@lru_cache(maxsize=None)
def _configuration(*parts: str) -> Dict[str, Any]:
    content: Dict[str, Any] = yaml.safe_load(config_file(*parts).read_text(encoding="utf-8"))
    return content


def arbiter_options(aircraft: str) -> Dict[str, Any]:
    """What tx_node's arbiter is made with for an aircraft."""
    tx, own = _configuration("tx.yaml"), _configuration("aircraft", f"{aircraft}.yaml")
    options = {key: tx[key] for key in ("command_timeout", "resume_grace", "transition_rate", "takeover_threshold")}
    options["initial_mode"] = AUTO if tx["initial_mode"] == "auto" else MANUAL
    options.update({key: own[key] for key in ("engines", "failsafe", "channels", "reverse_thrust") if key in own})
    return options


def excitation_limits_deg(aircraft: str) -> Tuple[float, float]:
    """Roll and pitch beyond which tx_node ends an excitation of an aircraft [deg]."""
    limits = _configuration("aircraft", f"{aircraft}.yaml")["excitation"]
    return limits["max_roll_deg"], limits["max_pitch_deg"]


def initial_state(start: Mapping[str, Any]) -> InitialState:
    """Where a flight begins, by the keys of `START`; what is not given is the aircraft's usual."""
    return InitialState(**{START[key]: value for key, value in start.items()})


@dataclass(frozen=True)
class Conditions:
    """How a flight begins and what it flies in; plain values, for another process."""

    aircraft: str
    start: Mapping[str, Any] = field(default_factory=dict)  #: keys of `START`
    weather: Mapping[str, Any] = field(default_factory=dict)  #: of `WEATHER`: [m/s], [deg], [m/s], [K], [Pa]
    loading: Mapping[str, Any] = field(default_factory=dict)  #: of `LOADING`: [kg] by tank, [kg], [m]
    attitude: Mapping[str, float] = field(default_factory=dict)  #: roll, pitch [deg], instead of the trimmed ones
    frame_rate: float = 60.0  #: [Hz]
    seed: int = 0  #: of the turbulence
    mode: Optional[int] = None  #: MANUAL or AUTO; None: as tx_node begins

    @property
    def air(self) -> Tuple[float, float]:
        """Difference from the standard temperature [K], pressure at sea level [Pa]."""
        return self.weather.get("temperature_offset", 0.0), self.weather.get("sea_level_pressure", 101325.0)

    def model(self) -> FlightModel:
        """The aircraft, loaded, in its wind and air, before its start."""
        model = create_model(self.aircraft, self.seed)
        from_rad, speed = math.radians(self.weather.get("wind_from", 0.0)), self.weather.get("wind_speed", 0.0)
        check_wind(speed)
        model.set_wind(-speed * math.cos(from_rad), -speed * math.sin(from_rad), 0.0)
        model.set_atmosphere(*self.air)
        if self.loading:
            model.set_loading(*(self.loading.get(key) for key in LOADING))
        return model

    def disturb(self, model: FlightModel) -> None:
        """What comes after the trimmed start: attitude and turbulence."""
        if self.attitude:
            turned: Dict[str, Any] = {f"{axis}_rad": math.radians(value) for axis, value in self.attitude.items()}
            model.place(**turned)
        if self.weather.get("turbulence", 0.0):
            model.set_turbulence(self.weather["turbulence"], self.seed)


class Aircraft:
    """An aircraft at the beginning of its flight: trimmed, in its wind.

    Raises:
        NotCompiledError: The compiled module is not there.
        FlightModelError: There is no such aircraft, start, weather or loading.
    """

    def __init__(self, conditions: Conditions) -> None:
        arbiter = require("a flight in process").ControlArbiter
        self.period = 1.0 / conditions.frame_rate  #: [s] of a frame
        self._shown_period: float = struct.unpack("<f", struct.pack("<f", self.period))[0]  # as X-Plane sends it
        self.frame = 0
        self.model = conditions.model()
        #: As commanded: what has failed may let something else through.
        self.controls = self.model.reset(initial_state(conditions.start))
        # A stick that nothing commands is centred, as the emulator's; levers and trims stay as the start left them.
        self.controls.roll = self.controls.pitch = self.controls.yaw = 0.0
        conditions.disturb(self.model)
        self._origin = LocalFrame(self.model.state.latitude_deg, self.model.state.longitude_deg)
        self.failures = Failures(self.model)
        self._trims = TrimsOnChange()
        options = arbiter_options(conditions.aircraft)
        if conditions.mode is not None:
            options["initial_mode"] = conditions.mode
        self._time = self._clock()
        self._arbiter = arbiter(options, self._time)

    @property
    def now(self) -> float:
        """[s] since the start."""
        return self.frame * self.period

    @property
    def shown_time(self) -> float:
        """The same as the bridge's states show it [s]: by the frame's period in float32."""
        return self.frame * self._shown_period

    def _clock(self) -> float:
        """[s] as tx_node has it in lock-step: to the microsecond, rounded as seconds beside a large number are."""
        return (_CLOCK_NS + round(self.frame * self.period * 1e6) * 1000) / 1e9

    @property
    def state(self) -> ModelState:
        """What the flight model really does; overwritten by the next step."""
        return self.model.state

    @property
    def mode(self) -> int:
        """MANUAL or AUTO."""
        mode: int = self._arbiter.mode
        return mode

    def view(self) -> FlightView:
        """What a controller sees of this frame."""
        state = self.model.state
        self._origin.follow(state.latitude_deg, state.longitude_deg)
        return FlightView(self.model.info, state, self.controls, self._origin, self.frame, self.period)

    def set_mode(self, mode: int, who: str) -> bool:
        """Asks for a mode; returns whether that changed it.

        A change acts at once, as through tx_node: on what was commanded before this frame.
        """
        before = self.mode
        self._arbiter.set_mode(mode, who, "request", self._time)
        changed = self.mode != before
        if changed:
            self._arbiter.step(self._time)
        return changed

    def commands(self, axis: str) -> bool:
        """Whether what flies commands roll, pitch, yaw or throttle, as of the last command or step."""
        flown: bool = self._arbiter.commands(axis)
        return flown

    def command(self, mode: int, values: Mapping[str, Any]) -> Optional[str]:
        """A command on control/manual or control/auto, answering this frame; why it is refused, or None."""
        refusal: Optional[str] = self._arbiter.command(mode, values, self._time)
        return refusal

    def step(self, excited: Optional[str] = None, value: float = 0.0) -> ModelState:
        """Flies a frame on; `value` is added to the channel `excited`.

        Raises:
            FlightModelError, ArithmeticError: The model gave up.
        """
        now = self._time
        sent = self._arbiter.step(now) if excited is None else self._arbiter.step(now, excited, value)
        # Not by a loop or a call, which take longer: few flights command trims.
        if "trim_pitch" in sent or "trim_roll" in sent or "trim_yaw" in sent:
            self._trims.leave_out(sent, self.mode, self.commands, now)
        apply_channels(sent, self.controls, self.model)
        state = self.model.step(self.period, self.failures.apply(self.controls, self.period))
        self.frame += 1
        self._time = self._clock()
        return state
