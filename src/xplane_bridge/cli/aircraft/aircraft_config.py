"""aircraft_config: writes the file by which tx_node flies the aircraft that is loaded in X-Plane."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any, Callable, Dict, Optional, Sequence

from xplane_bridge.aircraft_file.observed import Observed, observe
from xplane_bridge.aircraft_file.text import (
    FAILSAFES,
    KINDS,
    MULTIROTOR,
    TILTROTOR,
    Facts,
    likely_failsafe,
    likely_kind,
    likely_name,
    yaml_of,
)
from xplane_bridge.cli.entry import guarded, number, positive, udp_port
from xplane_bridge.errors import XplaneBridgeError

_PORT = 49000
_share = number("a lever position from 0 to 1", 0.0, 1.0)


class UnansweredError(XplaneBridgeError):
    """Something that X-Plane does not show was not said either."""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="aircraft_config",
        description="Looks at the aircraft that is loaded in X-Plane, asks what cannot be seen from outside, and "
        "writes the file by which tx_node flies it (config/aircraft/README.md). Changes nothing in X-Plane.",
    )
    p.add_argument("--host", default="127.0.0.1", help="X-Plane's computer, name or IPv4 address (%(default)s)")
    p.add_argument("--port", type=udp_port, default=_PORT, help="UDP port X-Plane listens on (%(default)s)")
    p.add_argument("--output", "-o", type=Path, metavar="FILE", help="what to write (default: NAME.yaml, here)")
    p.add_argument("--force", action="store_true", help="write over a file that is there")
    p.add_argument("--yes", action="store_true", help="ask nothing: take what is likely where no option says otherwise")
    p.add_argument("--name", help="of the aircraft: the parameter `aircraft` (default: of its description)")
    p.add_argument("--kind", choices=KINDS, help="(default: by engines, surfaces and thrust vector)")
    p.add_argument("--failsafe", choices=FAILSAFES, help="what the stick does when its source falls silent")
    p.add_argument(
        "--hover-throttle", type=_share, metavar="X", help="lever that carries a multirotor (default: as it hovers now)"
    )
    p.add_argument("--reverse", choices=("yes", "no"), help="whether levers below 0 are reverse thrust (default no)")
    p.add_argument("--conversion", type=positive, metavar="S", help="of a tiltrotor, hover to cruise (default 12)")
    return p


class Asker:
    """Gets what cannot be seen: from an option, else from the keyboard, else what is likely.

    Args:
        given: The options.
        ask: Reads a line after a prompt; None: there is no terminal to ask at.
    """

    def __init__(self, given: argparse.Namespace, ask: Optional[Callable[[str], str]]) -> None:
        self._given = vars(given)
        self._ask = ask

    def get(self, option: str, question: str, likely: Any, convert: Callable[[str], Any]) -> Any:
        """One answer.

        Args:
            option: Name in the command line, with underscores.
            question: In words.
            likely: What an empty line stands for; None: there is nothing likely.
            convert: Of what is typed; raises argparse.ArgumentTypeError.

        Raises:
            UnansweredError: There is no option, nothing likely, and no terminal to ask at.
        """
        if self._given[option] is not None:
            return self._given[option]
        switch = "--" + option.replace("_", "-")
        if self._ask is None or self._given["yes"]:
            if likely is not None and self._given["yes"]:
                return likely
            remedy = f"give {switch}" + (f", or --yes for {likely}" if likely is not None else "")
            raise UnansweredError(f"{question}: X-Plane does not show it; {remedy}")
        while True:
            typed = self._ask(f"{question} ({switch}){'' if likely is None else f' [{likely}]'}: ").strip()
            if not typed and likely is not None:
                return likely
            try:
                return convert(typed)
            except argparse.ArgumentTypeError as error:
                print(f"  {error}")


def one_of(words: Sequence[str]) -> Callable[[str], str]:
    """The conversion of an answer that is one of some words."""

    def convert(text: str) -> str:
        if text not in words:
            raise argparse.ArgumentTypeError(f"{text!r}: expected one of {', '.join(words)}")
        return text

    return convert


def file_stem(text: str) -> str:
    """The conversion of a name.

    Raises:
        argparse.ArgumentTypeError: It is no file's name.
    """
    if not text or not all(c.isalnum() or c in "_-" for c in text):
        raise argparse.ArgumentTypeError(f"{text!r}: expected letters, digits, _ and -")
    return text


def facts_of(seen: Observed, asker: Asker) -> Facts:
    """All that X-Plane does not show.

    Raises:
        UnansweredError: Something was not said.
    """
    name = asker.get("name", "name of the aircraft", likely_name(seen), file_stem)
    kind = asker.get("kind", f"kind of aircraft: {', '.join(KINDS)}", likely_kind(seen), one_of(KINDS))
    failsafe = asker.get(
        "failsafe",
        "stick when its source falls silent: neutral, hold, or manual (the joystick)",
        likely_failsafe(kind),
        one_of(FAILSAFES),
    )
    more: Dict[str, Any] = {}
    if kind == MULTIROTOR:
        hover = None if seen.hover is None else round(seen.hover, 2)
        more["hover_throttle"] = asker.get("hover_throttle", "lever that carries it in a hover, 0 to 1", hover, _share)
    elif seen.reverses:
        answer = asker.get("reverse", "are levers below 0 reverse thrust: yes or no", "no", one_of(("yes", "no")))
        more["reverse"] = answer == "yes"
    if kind == TILTROTOR:
        more["conversion"] = asker.get("conversion", "conversion from hover to cruise in seconds", 12.0, positive)
    return Facts(name=file_stem_or_error(name), kind=kind, failsafe=failsafe, **more)


def file_stem_or_error(name: str) -> str:
    """A name that came from an option.

    Raises:
        UnansweredError: It is no file's name.
    """
    try:
        return file_stem(name)
    except argparse.ArgumentTypeError as error:
        raise UnansweredError(f"--name: {error}") from None


def write(path: Path, text: str, force: bool) -> None:
    """Writes a file that is new.

    Raises:
        UnansweredError: It is there, or cannot be written.
    """
    try:
        with path.open("w" if force else "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise UnansweredError(f"{path} is there already; give --output FILE for another, or --force") from None
    except OSError as error:
        raise UnansweredError(f"{path} cannot be written: {error.strerror}; give --output FILE") from None


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs the program."""
    args = parser().parse_args(argv)
    seen = observe(args.host, args.port)
    print(f"loaded: {seen.description or 'no description'} ({seen.icao or 'no ICAO code'}), {seen.engines} engines")
    facts = facts_of(seen, Asker(args, input if sys.stdin.isatty() else None))
    path = args.output or Path(f"{facts.name}.yaml")
    write(path, yaml_of(seen, facts), args.force)
    print(f"written: {path}")
    print(f"fly it:  roslaunch xplane_bridge bridge.launch aircraft:={facts.name} aircraft_file:={path.resolve()}")
    return 0
