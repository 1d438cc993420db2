"""Texts of the emulator's command line as values."""

from __future__ import annotations

import argparse
import ipaddress
import math
import re
import socket
from typing import FrozenSet, List, Optional, Tuple

from xplane_bridge import protocol
from xplane_bridge.emulator.datarefs import otherwise
from xplane_bridge.emulator.flight.earth import wrap_degrees


class OptionError(ValueError):
    """An option that makes no sense; the message names it, what was given, and what is expected."""


def aerodrome(text: str) -> Tuple[float, float, float]:
    """Latitude, longitude and true heading [deg] of "37.46,126.44,40"."""
    try:
        latitude, longitude, heading = (float(part) for part in text.split(","))
    except ValueError:
        latitude = longitude = heading = math.nan
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0 and math.isfinite(heading)):
        raise argparse.ArgumentTypeError(
            f"{text!r}: expected latitude,longitude,heading in degrees, e.g. 37.46,126.44,40"
        )
    return latitude, longitude, heading


def otherwise_ids(text: str) -> FrozenSet[str]:
    """The ids of "a,b", or of "all"."""
    given = frozenset(otherwise.IDS if text == "all" else filter(None, text.split(",")))
    unknown = sorted(given - set(otherwise.IDS))
    if unknown:
        raise argparse.ArgumentTypeError(f"{', '.join(unknown)}: expected some of {', '.join(otherwise.IDS)}")
    return given


def address(text: str) -> str:
    """An IPv4 address of this machine."""
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind((str(ipaddress.IPv4Address(text)), 0))
        return text
    except (ValueError, OSError):
        raise argparse.ArgumentTypeError(f"{text}: expected an IPv4 address of this machine") from None


def endpoint(option: str, text: Optional[str]) -> Optional[Tuple[str, int]]:
    """Address and port of "IP:PORT"; None of None."""
    if text is None:
        return None
    host, _, port = text.partition(":")
    try:
        good = 1 <= int(port) <= 65535 and bool(ipaddress.IPv4Address(host))
    except ValueError:
        good = False
    require(good, option, text, "IP:PORT, e.g. 192.168.1.20:49003")
    return host, int(port)


def rows(text: str) -> Tuple[int, ...]:
    """Row numbers of "1,3,16-21"."""
    found: List[int] = []
    for part in filter(None, (item.strip() for item in text.split(","))):
        match = re.fullmatch(r"(\d+)(?:-(\d+))?", part)
        first, last = (int(match.group(1)), int(match.group(2) or match.group(1))) if match else (1, 0)
        good = first <= last < protocol.ROW_COUNT
        require(good, "--data-rows", text, f"numbers from 0 to {protocol.ROW_COUNT - 1} and ranges, e.g. 1,3,16-21")
        found += range(first, last + 1)
    return tuple(found)


def wind_from(text: str) -> Tuple[float, float]:
    """Direction it comes from [deg true] and speed [m/s] of "270/8"."""
    direction, slash, speed = text.partition("/")
    try:
        wind = float(direction), float(speed)
    except ValueError:
        wind = (math.nan, math.nan)
    if not slash or not all(map(math.isfinite, wind)) or not 0.0 <= wind[1] <= 60.0:
        raise OptionError(f"--wind {text}: expected FROM/SPEED in degrees true and m/s (0..60), e.g. 270/8")
    return wrap_degrees(wind[0]), wind[1]


def check_stepping(given: argparse.Namespace, delay: float, jitter: float) -> None:
    """Raises an `OptionError` for options that do not go with how frames are flown.

    Args:
        given: The command line.
        delay: Its `--pipeline-delay` [s].
        jitter: Its `--frame-jitter` [s].
    """
    stepped, duration, every = given.stepped, given.duration, given.picture_every
    lockstep = stepped == "lockstep"
    drawn = lockstep and given.window is not None
    require(stepped != "fast" or duration is not None, "--stepped", "fast", "--duration with it")
    require(
        stepped != "lines" or duration is None, "--duration", duration, "none with --stepped, whose lines say how long"
    )
    require(
        stepped is None or jitter == 0.0,
        "--frame-jitter",
        given.frame_jitter,
        "0 with --stepped, whose frames are all of one length",
    )
    require(0.0 <= given.pace <= 1000.0, "--pace", given.pace, "0..1000")
    require(lockstep or given.pace == 0.0, "--pace", given.pace, "--stepped lockstep with it")
    require(
        not (lockstep and given.fault), "--fault", given.fault, "none with --stepped lockstep, whose frames all arrive"
    )
    require(
        not (lockstep and given.loading_time > 0.0),
        "--loading-time",
        given.loading_time,
        "0 with --stepped lockstep, in which every frame is answered",
    )
    require(
        not (lockstep and given.deaf), "--deaf", "given", "--stepped other than lockstep, whose frames wait for answers"
    )
    require(1 <= every <= 1000, "--picture-every", every, "1..1000")
    require(drawn or every == 1, "--picture-every", every, "--window and --stepped lockstep with it")
    require(
        not drawn or delay == 0.0,
        "--pipeline-delay",
        given.pipeline_delay,
        "0 with --stepped lockstep, where a frame ends when its picture is on display",
    )


def require(good: bool, option: str, given: object, expected: str) -> None:
    """Raises an `OptionError` unless `good`."""
    if not good:
        raise OptionError(f"{option} {given}: expected {expected}")
