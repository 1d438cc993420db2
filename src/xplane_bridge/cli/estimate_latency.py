"""estimate_latency: the display delay, and how fast surfaces follow commands, measured from a flight."""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Dict, Iterator, List, Optional, Sequence, Union

import numpy as np

from xplane_bridge.analysis.commands import commanded, of_controls
from xplane_bridge.analysis.latency import (
    Delay,
    LatencyError,
    TooFewSamplesError,
    accumulated_rotation,
    fit_delay,
    require_usable,
    value_motion,
)
from xplane_bridge.analysis.quality import QUALITY_WORDS
from xplane_bridge.bags import FLIGHT_STATE, Bags
from xplane_bridge.bags.cameras import FIRST, cameras, chosen_cameras
from xplane_bridge.bags.segments import segments
from xplane_bridge.cli.bridge.waiting import Listener, print_waiting, wait_for_state, wait_until
from xplane_bridge.cli.entry import guarded, number, start_node
from xplane_bridge.constants import CameraView, ImageQuality, words
from xplane_bridge.harness.processes import ManagedProcess
from xplane_bridge.plotting.figure_file import figure_file
from xplane_bridge.plotting.page_file import refuse_recordings
from xplane_bridge.topics import NAMESPACE, absolute

if TYPE_CHECKING:
    from xplane_bridge.bags import Table

#: Line of sight in body axes (forward, right, down), by FrameState.view.
_AXES = {1: (1.0, 0.0, 0.0), 2: (-1.0, 0.0, 0.0), 3: (0.0, 0.0, 1.0)}
_VIEWS = {name: number for number, name in words(CameraView).items() if number != CameraView.UNKNOWN}
#: FrameState.POSE_NONE.
_POSE_NONE = 0
#: Pictures that say nothing about the delay.
_USELESS = (
    ImageQuality.DISPLAY_UNKNOWN | ImageQuality.FROZEN | ImageQuality.BLACK | ImageQuality.EXTERNAL_VIEW
    | ImageQuality.PAUSED | ImageQuality.REPLAY
)  # fmt: skip
#: Body rates are not known between states further apart than this: X-Plane was paused, or nothing came [s].
_LONGEST_STEP_S = 0.1
#: A command that stays the same for longer rests; until then it may be on its way from one value to the next [s].
_MOVING_S = 0.06
#: For which a recording may take longer than it is long: its start, and the writing at its end [s].
_PATIENCE_S = 30.0
#: What --live records, below the bridge's namespace, and of the camera below its own.
_PICTURES = "camera/image_raw/compressed"
_CAMERA_TOPICS = (_PICTURES, "camera/frame_state")
_LIVE_TOPICS = ("flight_state", "control/applied", "mission/surfaces")
#: Command and the surface that follows it.
_RESPONSES = (("roll", "delta_aileron"), ("pitch", "delta_elevator"), ("yaw", "delta_rudder"))


def parser() -> argparse.ArgumentParser:
    """Build the command line."""
    p = argparse.ArgumentParser(
        prog="estimate_latency",
        description="Measures the display delay from the pictures' own rotation against the recorded rates, and the "
        "delay from commands to surfaces. It takes 60 s with roll doublets or multisines (inject_excitation).",
        epilog="Put the result into the shared parameter display_delay (config/common.yaml).",
    )
    p.add_argument("bags", nargs="*", metavar="BAG", help="the flight's bag, its split bags, or a folder of them")
    p.add_argument(
        "--live",
        type=number("5 to 600 s", 5.0, 600.0),
        metavar="SECONDS",
        help="instead of a BAG: record the running bridge for so long, while the aircraft rolls",
    )
    p.add_argument(
        "--namespace", type=absolute, default=NAMESPACE, metavar="NS", help="of the bridge, for --live (%(default)s)"
    )
    p.add_argument(
        "--camera",
        default="",
        metavar="NAME",
        help="of several cameras, the one to measure, as camera.launch names it (default: the bridge's own, camera)",
    )
    p.add_argument("--view", choices=sorted(_VIEWS), help="where camera/frame_state does not say it")
    p.add_argument(
        "--ignore-bottom",
        type=number("a share from 0 to 0.9", 0.0, 0.9),
        default=0.05,
        metavar="0..1",
        help="share of the picture at its lower edge that does not show the scene (default: %(default)s)",
    )
    p.add_argument("--plot", type=figure_file, metavar="FILE", help="figure of cost and fit, e.g. delay.png")
    p.add_argument("--json", type=Path, metavar="FILE", help="the numbers as JSON")
    return p


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the program."""
    p = parser()
    args = p.parse_args(argv)
    if bool(args.bags) == bool(args.live):
        p.error("give a BAG, or --live SECONDS")
    with contextlib.ExitStack() as stack:
        space = args.namespace.rstrip("/")
        paths = [stack.enter_context(_recorded(space, args.camera, args.live))] if args.live else args.bags
        bags = stack.enter_context(Bags(paths))
        for output in filter(None, (args.plot, args.json)):
            refuse_recordings(output, bags.paths)
        display = display_delay(bags, _VIEWS[args.view] if args.view else None, args.ignore_bottom, args.camera)
        responses = command_responses(bags)
    require_usable(display, "pictures")
    print(f"display delay       {_text(display)}   gain {display.gain:.3f}, {display.samples} pairs of pictures")
    usable = {"display delay": display}
    numbers: Dict[str, Dict[str, Union[float, str]]] = {"display_delay": _numbers(display)}
    for name, result in responses.items():
        try:
            require_usable(result, name, gain_range=None)
        except LatencyError as error:
            print(f"{name:<19} not determined: {error}")
            numbers[name] = {"not_determined": str(error)}
        else:
            print(f"{name:<19} {_text(result)}")
            usable[name], numbers[name] = result, _numbers(result)
    try:
        if args.plot:
            from xplane_bridge.plotting.latency import save

            save(usable, args.plot)
            print(args.plot)
        if args.json:
            args.json.write_text(json.dumps(numbers, indent=2, allow_nan=False) + "\n")
    except OSError as error:
        msg = f"{error.filename}: {error.strerror}"
        raise LatencyError(msg) from None
    return 0


@contextlib.contextmanager
def _recorded(namespace: str, camera: str, seconds: float) -> Iterator[Path]:
    """A bag of the bridge that runs, recorded now."""
    start_node("estimate_latency", anonymous=True)
    from sensor_msgs.msg import CompressedImage

    wait_for_state(namespace, "estimate_latency")
    place = namespace if camera in ("", FIRST) else f"{namespace}/{camera}"
    pictures = Listener(f"{place}/{_PICTURES}", CompressedImage)
    wait_until(pictures.came.is_set, pictures.why_none, print_waiting("estimate_latency"))
    pictures.close()
    print(f"estimate_latency: recording {seconds:g} s; let the aircraft roll to and fro", file=sys.stderr, flush=True)
    with tempfile.TemporaryDirectory(prefix="estimate_latency_") as folder:
        bag = Path(folder) / "live.bag"
        topics = [f"{namespace}/{topic}" for topic in _LIVE_TOPICS] + [f"{place}/{topic}" for topic in _CAMERA_TOPICS]
        command: List[Union[str, Path]] = ["rosbag", "record", "-O", bag, f"--duration={round(seconds)}", *topics]
        with ManagedProcess("record", command, bag.parent) as run:
            if run.wait(seconds + _PATIENCE_S) != 0 or not bag.is_file():
                msg = f"nothing was recorded: {run.output().strip()}"
                raise LatencyError(msg)
        yield bag


def display_delay(bags: Bags, view: Optional[int] = None, ignore_bottom: float = 0.05, camera: str = "") -> Delay:
    """Delay from a simulator frame to its display: mean of picture stamp minus host time of the frame shown.

    Args:
        bags: Open bags with camera pictures and flight_state.
        view: FrameState.view; None: the line of sight is that of the recorded pose, else of the recorded view.
        ignore_bottom: Share of the picture at its lower edge that does not show the scene.
        camera: Its name; the first of the recording when empty.

    Raises:
        BagError: No pictures or states.
        LatencyError: The recording does not show it.
    """
    from xplane_bridge.analysis.image_rotation import rotation_motion
    from xplane_bridge.bags.pictures import grey_pictures

    time, rates = _rates(bags)
    topic, frames = _pictures(bags, camera)
    useful, recorded = (None, None) if frames is None else _useful(frames)
    axis = recorded if view is None else np.array(_AXES[view])
    if axis is None:
        msg = "the recording does not say where the camera looks, forward, rear or down: give --view"
        raise LatencyError(msg)
    zero = time[0]
    stamps: List[float] = []

    def chosen() -> Iterator[tuple[float, np.ndarray]]:
        for stamp, picture in grey_pictures(bags, topic):
            if useful is None or stamp in useful:
                stamps.append(1e-9 * (stamp - zero))
                yield stamps[-1], picture

    motion = rotation_motion(chosen(), ignore_bottom)
    seconds = 1e-9 * (time - zero)
    parts = segments(time, max_gap=_LONGEST_STEP_S)
    gaps = [(seconds[before.stop - 1], seconds[after.start]) for before, after in zip(parts, parts[1:])]
    try:
        return fit_delay(motion, seconds, accumulated_rotation(seconds, rates, axis), gaps=gaps)
    except TooFewSamplesError as error:
        raise LatencyError(_why_few(frames, stamps) or str(error)) from None


def command_responses(bags: Bags) -> dict[str, Delay]:
    """Delay of each surface behind the command that it follows, where both were recorded and moved.

    A moving command is sent again until its next value comes; only the first sending of a value counts. As a control
    law sees it: a value that holds until the next one is half that time old on average, which is part of the delay.
    """
    commands = _first_of_type(bags, "xplane_bridge/AppliedCommand")
    surfaces = _first_of_type(bags, "xplane_bridge/SurfaceStates")
    results: dict[str, Delay] = {}
    if commands is None or surfaces is None:
        return results
    zero = commands.stamp[0]
    lead_time, late_time = 1e-9 * (commands.stamp - zero), 1e-9 * (surfaces.stamp - zero)
    own = np.flatnonzero(of_controls(commands.columns))
    order, late_order = own[_increasing(lead_time[own])], _increasing(late_time)
    for command, surface in _RESPONSES:
        lead, late = commands[command][order], surfaces[surface][late_order]
        known, known_late = commanded(commands.columns, command)[order] & np.isfinite(lead), np.isfinite(late)
        if known.sum() < 2 or np.ptp(lead[known]) < 0.02 or known_late.sum() < 2:
            continue
        sent, value, shown = lead_time[order][known], lead[known], late_time[late_order][known_late]
        rows = np.flatnonzero(known)
        gaps = [(lead_time[order[k]], lead_time[order[n]]) for k, n in zip(rows[:-1], rows[1:]) if n - k > 1]
        news = ~_refreshes(sent, value)
        motion = value_motion(shown, late[known_late], _frames_of_a_value(sent[news], value[news], shown))
        try:
            results[f"{command} command"] = fit_delay(motion, sent[news], value[news], gaps=gaps)
        except LatencyError:
            continue  # too short; the display delay has said so already
    return results


def _frames_of_a_value(sent: np.ndarray, value: np.ndarray, shown: np.ndarray) -> int:
    """For how many frames a moving command holds a value: between neighbouring ones most surfaces would stand still."""
    changes = sent[1:][np.diff(value) != 0.0]
    if len(changes) < 2:
        return 1
    return max(1, round(float(np.median(np.diff(changes)) / np.median(np.diff(shown)))))


def _refreshes(sent: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Which samples only repeat what was sent shortly before [bool]; those of a command that rests are kept."""
    first = np.append(True, np.diff(value) != 0.0)
    since = sent - sent[np.maximum.accumulate(np.where(first, np.arange(len(first)), 0))]
    refreshes: np.ndarray = ~first & (since < _MOVING_S)
    return refreshes


def _rates(bags: Bags) -> tuple[np.ndarray, np.ndarray]:
    """Stamps [ns] and body rates [rad/s] of the longest epoch, but for pauses."""
    table = _first_of_type(bags, FLIGHT_STATE)
    if table is None:
        msg = "no flight states: record flight_state too (launch/record.launch does)"
        raise LatencyError(msg)
    rates = np.column_stack([table[f"angular_velocity.{axis}"] for axis in "xyz"])
    epochs, counts = np.unique(table["epoch"], return_counts=True)
    use = (table["epoch"] == epochs[np.argmax(counts)]) & ~table["paused"].astype(bool) & np.isfinite(rates).all(axis=1)
    time = table.stamp[use]
    order = _increasing(time)
    if len(order) < 2:
        msg = "no flight states with body rates"
        raise LatencyError(msg)
    return time[order], rates[use][order]


def _pictures(bags: Bags, name: str) -> tuple[str, Optional[Table]]:
    """The topic of a camera's pictures, and its FrameStates where they were recorded.

    Raises:
        BagError: The bags have no such camera, or no pictures of it.
    """
    from xplane_bridge.bags.pictures import image_topic

    if not cameras(bags) and not name:
        return image_topic(bags), None
    camera = chosen_cameras(bags, [name] if name else [])[0]
    if not camera.images:
        image_topic(bags)  # says what to record where there is none at all
        other = "record them (launch/record.launch does), or choose another with --camera"
        msg = f"no images of camera {camera.name}: {other}"
        raise LatencyError(msg)
    return camera.images, bags.read(camera.frames)


def _useful(frames: Table) -> tuple[set[int], Optional[np.ndarray]]:
    """Stamps [ns] of the pictures to use: those of the view that most have; and their line of sight in body axes.

    Raises:
        LatencyError: There are none.
    """
    views, counts = np.unique(frames["view"], return_counts=True)
    view = int(views[np.argmax(counts)])
    use = ~_useless(frames) & (frames["view"] == view)
    if not use.any():
        raise LatencyError(_left_out(frames))
    posed = use & (frames["camera_pose_source"] != _POSE_NONE)
    if posed.any():
        x, y, z, w = (frames[f"body_to_camera.rotation.{axis}"][posed] for axis in "xyzw")
        sight = np.median([2.0 * (x * z + w * y), 2.0 * (w * x - y * z), 2.0 * (x * x + y * y) - 1.0], axis=1)
        axis = sight / np.linalg.norm(sight)
    else:
        axis = np.array(_AXES[view]) if view in _AXES else None
    return {int(stamp) for stamp in frames.stamp[use]}, axis


def _useless(frames: Table) -> np.ndarray:
    """Whether each picture says nothing about the delay, by its quality."""
    useless: np.ndarray = (frames["quality"] & _USELESS.value) != 0
    return useless


def _why_few(frames: Optional[Table], stamps: Sequence[float]) -> str:
    """Why few pictures could be compared; empty: there are few.

    Args:
        frames: FrameStates, where they were recorded.
        stamps: [s] of the pictures that are used.
    """
    from xplane_bridge.analysis.image_rotation import MAX_PAUSE_S

    if frames is not None and np.mean(_useless(frames)) > 0.5:
        return _left_out(frames)
    period = float(np.median(np.diff(stamps))) if len(stamps) > 1 else 0.0
    if period < 0.95 * MAX_PAUSE_S:  # just about that far apart, half of them are compared by chance
        return ""
    rate = 2.0 / MAX_PAUSE_S
    return (
        f"the pictures come too slowly, every {period:.2f} s (median): two that are compared must be less than "
        f"{MAX_PAUSE_S:g} s apart; expected {rate:.0f} pictures/s or more: record with a higher image rate"
    )


def _left_out(frames: Table) -> str:
    """Which quality of the pictures says that they are of no use, and of how many."""
    counts = {bit: int(np.count_nonzero(frames["quality"] & bit.value)) for bit in ImageQuality if bit & _USELESS}
    bits = ", ".join(
        f"{count}: QUALITY_{bit.name} ({QUALITY_WORDS[str(bit.name)]})" for bit, count in counts.items() if count
    )
    return f"of {len(frames)} pictures these are of no use: {bits}; expected most of them without these bits"


def _first_of_type(bags: Bags, msgtype: str) -> Optional[Table]:
    topic = bags.topic_of_type(msgtype)
    return bags.read(topic) if topic is not None and bags.topics[topic].count else None


def _increasing(time: np.ndarray) -> np.ndarray:
    """Indices of the samples in strictly increasing time."""
    return np.unique(time, return_index=True)[1]


def _text(result: Delay) -> str:
    low, high = 1e3 * result.low, 1e3 * result.high
    return f"{1e3 * result.delay:7.1f} ms   95 % interval {low:.1f} .. {high:.1f} ms"


def _numbers(result: Delay) -> Dict[str, Union[float, str]]:
    names = ("delay", "sigma", "low", "high", "gain", "drift", "correlation", "samples")
    return {name: getattr(result, name) for name in names}
