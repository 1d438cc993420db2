"""live_plot: live curves of message fields, for machines without rqt_plot."""

from __future__ import annotations

import argparse
import re
import time
from typing import Any, Callable, Iterator, NamedTuple, Optional, Sequence

from xplane_bridge.cli.entry import guarded, positive, ros_arguments, start_node
from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.plotting.figure_file import figure_file
from xplane_bridge.plotting.live import LiveWindow, RollingSeries, can_show

_TOPIC_POLL_S = 0.2
_PART = re.compile(r"^(\w+)(?:\[(\d+)\])?$")


class LivePlotError(XplaneBridgeError):
    """A field cannot be plotted."""


class Field(NamedTuple):
    """One curve: a topic and the path of a number in its messages."""

    topic: str
    path: str  #: e.g. ``angular_velocity/x``, ``engine_speed[0]``


def parser() -> argparse.ArgumentParser:
    """Build the command line."""
    p = argparse.ArgumentParser(
        prog="live_plot",
        description="Plots fields of live topics. Each argument is a pair of axes; commas share one pair of axes.",
        epilog="example: live_plot /xplane/flight_state/roll_deg,pitch_deg /xplane/mission/engines/engine_speed[0]",
    )
    p.add_argument("fields", nargs="+", metavar="TOPIC/FIELD[,FIELD...]", help="as for rqt_plot")
    p.add_argument("--window", type=positive, default=60.0, metavar="S", help="width of the time axis (%(default)g s)")
    p.add_argument("--wait", type=positive, default=30.0, metavar="S", help="for the topics to appear (%(default)g s)")
    p.add_argument(
        "--png", type=figure_file, default="live_plot.png", metavar="FILE", help="what the s key writes (%(default)s)"
    )
    p.add_argument(
        "--after", type=positive, metavar="S", help="write the PNG by itself after so long, and end; needs no display"
    )
    return p


def split(argument: str) -> list[str]:
    """Split ``TOPIC/FIELD,FIELD2`` into full names; what follows a comma shares the first one's parent."""
    first, *others = argument.split(",")
    parent = first.rpartition("/")[0]
    return [first, *(other if other.startswith("/") else f"{parent}/{other}" for other in others)]


def locate(name: str, topics: Sequence[str]) -> Optional[Field]:
    """Divide a full name into topic and path by the longest published topic that begins it."""
    fitting = [topic for topic in topics if name.startswith(topic + "/")]
    if not fitting:
        return None
    topic = max(fitting, key=len)
    return Field(topic, name[len(topic) + 1 :])


def getter(path: str, message_type: Any) -> Callable[[Any], float]:
    """Make the function that takes the number at `path` out of a message.

    Raises:
        LivePlotError: No such field, or it is no number; the text lists the fields there are.
    """
    steps: list[tuple[str, Optional[int]]] = []
    sample = message_type()
    for part in path.split("/"):
        match = _PART.match(part)
        name, index = (match.group(1), match.group(2)) if match else ("", None)
        if name not in getattr(sample, "__slots__", []):
            have = ", ".join(getattr(sample, "__slots__", [])) or "nothing below it"
            msg = f"{message_type._type} has no field {path!r}: at {part!r} there is {have}"
            raise LivePlotError(msg)
        sample = getattr(sample, name)
        steps.append((name, None if index is None else int(index)))
        if index is not None:
            if not isinstance(sample, (list, tuple, bytes)):
                msg = f"{message_type._type}: {name} is no array, so [{index}] does not apply"
                raise LivePlotError(msg)
            if sample and int(index) >= len(sample):  # a list of varying length is empty here
                have = f"{name}[0] to {name}[{len(sample) - 1}]"
                msg = f"{message_type._type} has no field {path!r}: at {part!r} there is {have}"
                raise LivePlotError(msg)
            sample = sample[int(index)] if sample else 0.0
    if not isinstance(sample, (int, float)):
        msg = f"{message_type._type}: {path} is no number ({type(sample).__name__}); give an element or a field of it"
        raise LivePlotError(msg)

    def get(message: Any) -> float:
        for name, index in steps:
            message = getattr(message, name)
            if index is not None:
                message = message[index] if index < len(message) else float("nan")
        return float(message)

    return get


def without_field(topic: str, message_type: Any) -> LivePlotError:
    """Make the error for a topic that is given without a field of it.

    Args:
        topic: Its name.
        message_type: Of its messages; None: not built here.
    """
    if message_type is None:
        return LivePlotError(f"{topic} is a topic: name a field of it, e.g. {topic}/x")
    example = next(_numbers(message_type()), "FIELD")
    have = ", ".join(message_type.__slots__) or "no field"
    kind = message_type._type
    return LivePlotError(f"{topic} is a topic ({kind}): name a field of it, e.g. {topic}/{example}; it has: {have}")


def _numbers(sample: Any) -> Iterator[str]:
    """Paths of the numbers in a message, headers left out; those with a fraction first, which make curves."""
    found: list[tuple[bool, str]] = []
    for name in sample.__slots__:
        value, path = getattr(sample, name), name
        if isinstance(value, (list, tuple)) and value:
            value, path = value[0], f"{name}[0]"
        if isinstance(value, (int, float)):
            found.append((not isinstance(value, float), path))
        elif name != "header" and hasattr(value, "__slots__") and hasattr(value, "_type"):
            found += [(False, f"{path}/{inner}") for inner in _numbers(value)]
    return (path for _, path in sorted(found, key=lambda each: each[0]))


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the program."""
    args = parser().parse_args(ros_arguments(argv))
    if args.after is None and not can_show():
        msg = (
            "no window can be opened here: there is no display (DISPLAY), or matplotlib has no toolkit for it "
            f"(python3-tk); without one, --after S --png {args.png} draws for S seconds and writes the picture"
        )
        raise LivePlotError(msg)
    rospy = start_node("live_plot", anonymous=True, disable_signals=True)
    names = [[rospy.resolve_name(name) for name in split(argument)] for argument in args.fields]
    found = _wait_for([name for group in names for name in group], args.wait)
    groups = [(_label(group), [RollingSeries(_short(name, group), args.window) for name in group]) for group in names]
    for group, (_, series) in zip(names, groups):
        for name, one in zip(group, series):
            _subscribe(found[name], one)
    window = LiveWindow(groups, args.window, args.png)
    try:
        window.run(args.after)
    except OSError as error:
        msg = f"{args.png} is not written: {error.strerror or error}"
        raise LivePlotError(msg) from None
    finally:
        rospy.signal_shutdown("closed")
    return 0


def _wait_for(names: Sequence[str], timeout: float) -> dict[str, Field]:
    import roslib.message
    import rospy

    deadline = time.monotonic() + timeout
    while True:
        types = dict(rospy.get_published_topics())
        topics = list(types)
        found = {name: locate(name, topics) for name in names}
        for name, where in found.items():
            if where is None and name in types:
                raise without_field(name, roslib.message.get_message_class(types[name]))
        missing = [name for name, where in found.items() if where is None]
        if not missing:
            return {name: where for name, where in found.items() if where is not None}
        if time.monotonic() > deadline:
            have = ", ".join(sorted(topics)) or "no topic"
            msg = f"no topic begins {missing[0]} after {timeout:g} s; published: {have}"
            raise LivePlotError(msg)
        time.sleep(_TOPIC_POLL_S)


def _subscribe(field: Field, series: RollingSeries) -> None:
    import roslib.message
    import rospy

    types = dict(rospy.get_published_topics())
    message_type = roslib.message.get_message_class(types[field.topic])
    if message_type is None:
        msg = f"{field.topic}: messages of type {types[field.topic]} are not built here; source their workspace"
        raise LivePlotError(msg)
    get = getter(field.path, message_type)

    def take(message: Any) -> None:
        stamp = message.header.stamp.to_sec() if message._has_header else 0.0
        series.add(stamp or rospy.get_time(), get(message))

    rospy.Subscriber(field.topic, message_type, take, queue_size=100, tcp_nodelay=True)


def _label(group: Sequence[str]) -> str:
    return group[0].rpartition("/")[2] if len(group) == 1 else group[0].rpartition("/")[0].rpartition("/")[2]


def _short(name: str, group: Sequence[str]) -> str:
    parents = {other.rpartition("/")[0] for other in group}
    return name.rpartition("/")[2] if len(parents) == 1 else name
