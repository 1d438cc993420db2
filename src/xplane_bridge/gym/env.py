"""The environment: one aircraft, one episode after the other."""

from __future__ import annotations

from typing import Any, Callable, Dict, Mapping, Optional, Sequence, Tuple, Union

import gymnasium
import numpy as np
from gymnasium import spaces

from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.flight.flight_model import FlightModelError, ModelState, TrimError
from xplane_bridge.emulator.flight.limits import check_turbulence
from xplane_bridge.errors import is_number
from xplane_bridge.gym.episodes import Episode, Episodes
from xplane_bridge.gym.errors import GymError
from xplane_bridge.gym.flights import Flight, InProcessFlight
from xplane_bridge.gym.spaces import DEFAULT_AXES, DEFAULT_FIELDS, Commander, Observer
from xplane_bridge.gym.tasks import Task
from xplane_bridge.in_process.aircraft import Conditions, initial_state

OVERSPEED = "faster than the never-exceed speed"
TIME = "time is up"
#: Width and height [px] of what `render` gives.
RENDERED = (640, 480)
_FRAME_RATES = (20.0, 240.0)
_MOST_PIXELS = 4096
#: How often a start is drawn before it is said that none can be flown.
_DRAWS = 20

Observation = Union[np.ndarray, Dict[str, np.ndarray]]


class FlyEnv(gymnasium.Env[Any, Any]):
    """Flies an aircraft of the emulator as the bridge does: one frame of delay, float32, tx_node's own arbiter.

    Args:
        aircraft: Of the emulator: fixed_wing, multirotor, tiltrotor.
        task: Makes what an episode is about; a class of `tasks`, or one's own.
        fields: What is observed, names of `spaces.FIELDS`; None: as the task says.
        axes: What is commanded, fields of ControlCommand; None: as the task says.
        episode: How episodes begin (`episodes.Episodes`), over what the task says.
        frame_rate: [Hz] of the simulator, 20..240.
        frames: Flown with each action.
        duration: [s] of simulated time after which an episode is truncated.
        image: Width and height [px] of a picture beside the fields: the observation is a Dict of `state` and `image`.
        bridge: None: in process; "ros": over rx_node and tx_node in lock-step, started anew for each episode.
        render_mode: None or "rgb_array".

    Raises:
        GymError, CampaignError: Something of this makes no sense.
        NotCompiledError: The compiled module is not there.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 30}  # noqa: RUF012

    def __init__(
        self,
        aircraft: str = "fixed_wing",
        task: Callable[[], Task] = Task,
        fields: Optional[Sequence[str]] = None,
        axes: Optional[Sequence[str]] = None,
        episode: Optional[Mapping[str, Any]] = None,
        frame_rate: float = 60.0,
        frames: int = 2,
        duration: float = 60.0,
        image: Optional[Sequence[int]] = None,
        bridge: Optional[str] = None,
        render_mode: Optional[str] = None,
    ) -> None:
        _check(frame_rate, frames, duration, image, render_mode)
        model = create_model(aircraft)
        self._info = info = model.info
        self._task = task()
        self._observer = Observer(tuple(fields or self._task.fields or DEFAULT_FIELDS))
        #: What makes commands of actions.
        self.commander = Commander(tuple(axes or self._task.axes or DEFAULT_AXES[aircraft]), info)
        self._episodes = Episodes(model, frame_rate, {**self._task.episode, **(episode or {})})
        self._frames, self._longest = frames, duration - 0.5 / frame_rate
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": round(frame_rate / frames)}
        self.action_space = self.commander.space
        self.observation_space = self._observer.space
        self._image = None if image is None else (image[0], image[1])
        self._cameras: Dict[Tuple[int, int], Any] = {}
        if self._image is not None:
            width, height = self._image
            picture = spaces.Box(0, 255, (height, width, 3), np.uint8)
            self.observation_space = spaces.Dict({"state": self._observer.space, "image": picture})
        self._bridged = bridge is not None
        self._flight = _flight(bridge)
        self._flying = False
        self._began = 0.0

    @property
    def field_names(self) -> Tuple[str, ...]:
        """Of the elements of an observation's `state`."""
        return self._observer.names

    @property
    def axis_names(self) -> Tuple[str, ...]:
        """Of the elements of an action."""
        return self.commander.names

    @property
    def truth(self) -> ModelState:
        """What the flight model really does, in doubles: a copy."""
        return self._flight.truth.copy()

    def reset(
        self, *, seed: Optional[int] = None, options: Optional[Mapping[str, Any]] = None
    ) -> Tuple[Observation, Dict[str, Any]]:
        """Begins an episode.

        Args:
            seed: Of everything random from now on.
            options: Keys of `episode`, for this episode alone.

        Raises:
            FlightModelError: The aircraft cannot fly like this; where that hangs on what is drawn, in none of 20 draws.
            GymError, CampaignError: An option makes no sense.
        """
        super().reset(seed=seed)
        episodes = self._episodes.fixed(options or {})
        self._flying = False
        drawn = self._begin(episodes)
        self._place_cameras()
        state = self._flight.state()
        self._began = self._flight.now
        self._task.begin(state)
        self._flying = True
        info = {
            "sim_time": self._began,
            "conditions": drawn.options,
            "trim_action": self.commander.action_of(self._flight.trim),
        }
        return self._observation(state), info

    def step(self, action: Any) -> Tuple[Observation, float, bool, bool, Dict[str, Any]]:
        """Flies on. The last info of an episode says by `outcome` how it ended.

        Raises:
            GymError: There is no episode, or this is no action.
        """
        if not self._flying:
            raise GymError("step: no episode is being flown; call reset first")
        command = self.commander.command(action)
        flight, outcome = self._flight, ""
        for _ in range(self._frames):
            outcome = flight.fly(command)
            if outcome:
                break
        state = flight.state()
        outcome = outcome or self._left_envelope(state) or self._task.ended(state)
        terminated = bool(outcome)
        now = flight.now
        truncated = not terminated and now - self._began >= self._longest
        info: Dict[str, Any] = {"sim_time": now}
        if terminated or truncated:
            info["outcome"] = outcome or TIME
            self._flying = False
        return self._observation(state), float(self._task.reward(state, command)), terminated, truncated, info

    def render(self) -> Optional[np.ndarray]:
        """The forward view, 640x480; None where no `render_mode` was asked for."""
        return self._picture(RENDERED) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Ends what was started for it; may be called again."""
        self._flying = False
        self._flight.close()

    def _begin(self, episodes: Episodes) -> Episode:
        """Begins the next episode that the aircraft can fly: tails of distributions reach where it cannot."""
        draws = _DRAWS if episodes.vary else 1
        for draw in range(1, draws + 1):
            drawn = episodes.draw(self.np_random)
            try:
                self._flight.begin(drawn)
                break
            except FlightModelError as error:
                if draws == 1 or (isinstance(error, TrimError) and not episodes.trims_vary):
                    raise
                wrong = _refusal(episodes.undrawn()) if draw == 1 else None
                if wrong is not None:
                    raise wrong from None
                if draw < draws:
                    continue
                raise FlightModelError(
                    f"{error} (the last of {draws} draws, none of which can be flown: narrow the distributions of "
                    "episode)"
                ) from None
        return drawn

    def _left_envelope(self, state: Any) -> str:
        return OVERSPEED if state.calibrated_airspeed > self._info.never_exceed_mps else ""

    def _observation(self, state: Any) -> Observation:
        observed = self._observer.observe(state)
        if self._bridged and np.isnan(observed).any():
            unknown = [name for name, value in zip(self.field_names, observed) if np.isnan(value)]
            raise GymError(f"flight_state has no {', '.join(unknown)} in this frame; see /diagnostics of rx_node")
        return observed if self._image is None else {"state": observed, "image": self._picture(self._image)}

    def _place_cameras(self) -> None:
        """The aerodrome lies where the flight starts."""
        if self._image is None and self.render_mode is None:
            return
        from xplane_bridge.gym.pictures import Camera  # brings OpenCV

        truth = self._flight.truth
        anchor = (truth.latitude_deg, truth.longitude_deg)
        sizes = {size for size in (self._image, RENDERED if self.render_mode else None) if size is not None}
        self._cameras = {size: Camera(size, anchor) for size in sizes}

    def _picture(self, size: Tuple[int, int]) -> np.ndarray:
        if size not in self._cameras:
            raise GymError("render: no episode has begun; call reset first")
        picture: np.ndarray = self._cameras[size].picture(self._flight.truth)
        return picture


def _refusal(conditions: Conditions) -> Optional[FlightModelError]:
    """What is wrong with a number of these, whatever the others are; None: nothing."""
    try:
        check_turbulence(conditions.weather.get("turbulence", 0.0))
        conditions.model().reset(initial_state(conditions.start))
    except TrimError:
        return None
    except FlightModelError as error:
        return error
    return None


def _flight(bridge: Optional[str]) -> Flight:
    if bridge is None:
        return InProcessFlight()
    if bridge != "ros":
        raise GymError(f"bridge: {bridge!r}; expected None or 'ros'")
    from xplane_bridge.gym.ros_flight import RosFlight  # brings the harness

    return RosFlight()


def _check(
    frame_rate: float, frames: int, duration: float, image: Optional[Sequence[int]], render_mode: Optional[str]
) -> None:
    low, high = _FRAME_RATES
    if not (is_number(frame_rate) and low <= frame_rate <= high):
        raise GymError(f"frame_rate: {frame_rate!r}; expected {low:g}..{high:g} Hz")
    if isinstance(frames, bool) or not isinstance(frames, int) or frames < 1:
        raise GymError(f"frames: {frames!r}; expected a whole number from 1")
    if not (is_number(duration) and duration > 0.0):
        raise GymError(f"duration: {duration!r}; expected seconds, more than 0")
    sizes = image if isinstance(image, (tuple, list)) else ()
    if image is not None and not (
        len(sizes) == 2 and all(isinstance(size, int) and 16 <= size <= _MOST_PIXELS for size in sizes)
    ):
        raise GymError(f"image: {image!r}; expected (width, height), each 16..{_MOST_PIXELS} pixels")
    if render_mode not in (None, "rgb_array"):
        raise GymError(f"render_mode: {render_mode!r}; expected None or 'rgb_array'")
