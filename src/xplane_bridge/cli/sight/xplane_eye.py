"""The command line of the sender of pictures; docs/setups/windows.md describes it."""

from __future__ import annotations

import argparse
import codecs
import contextlib
import sys
import time
from pathlib import Path
from typing import Callable, Optional, Sequence, Tuple

from xplane_bridge.cli.entry import guarded, number, with_values_below_zero
from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.eye.calibrate import default_undo_file
from xplane_bridge.eye.grab import TITLES, Which
from xplane_bridge.eye.program import Eye, EyeOptions
from xplane_bridge.eye.rref import THIS_COMPUTER
from xplane_bridge.eye.wire import MOST_TEXT

_LOCAL_PORT = 49711


class TokenError(XplaneBridgeError):
    """The file of --token-file holds no token that can be sent."""


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Sends pictures until Ctrl-C, or verifies the pairing once; then 1 means that it is not as good as promised."""
    parser = _parser()
    given = parser.parse_args(with_values_below_zero(sys.argv[1:] if argv is None else argv))
    if (given.receiver is None) != given.verify:
        parser.error("expected either HOST:PORT of capture_node, to send pictures there, or --verify, which sends none")
    token = _token(given.token_file) if given.token_file else ""
    options = EyeOptions(
        receiver=given.receiver,
        xplane=given.xplane,
        titles=tuple(given.title) if given.title else TITLES,
        window=given.window,
        token=token,
        quality=given.quality,
        delay_s=given.delay,
        calibrate=given.calibrate,
        while_recorded=given.calibrate_now,
        local_port=given.local_port,
        undo_file=given.undo_file,
    )
    eye = Eye(options, _say)
    eye.run()
    for line in eye.findings.lines() if eye.findings else ():
        _say(line)
    return 0 if eye.findings is None or eye.findings.good else 1


def _token(path: Path) -> str:
    """The text of a file as editors and shells of Windows write it: PowerShell 5's `>` makes UTF-16.

    Raises:
        TokenError: It cannot be read, or is no such text.
    """
    try:
        raw = path.read_bytes()
        wide = raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        token = raw.decode("utf-16" if wide else "utf-8-sig").strip()
        if len(token.encode("utf-8")) <= MOST_TEXT:
            return token
        problem = f"its text is longer than {MOST_TEXT} bytes"
    except OSError as error:
        problem = str(error.strerror or error)
    except UnicodeDecodeError:
        problem = "it is no text in UTF-8 or UTF-16"
    raise TokenError(f"{path}: {problem}; --token-file takes a text file that holds capture_node's sender/token")


def _say(text: str) -> None:
    print(f"{time.strftime('%H:%M:%S')} {text}", flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="xplane_eye",
        description="Sends the pictures of X-Plane's window, each with the frame it shows, to capture_node (source: "
        "sender) on another computer. Runs beside X-Plane; needs no ROS. At its start it measures the delay from a "
        "frame to its picture by steps of X-Plane's field of view, which it gives back; start it before recording. "
        "After three measurements in vain it sends without, and flags each picture.",
    )
    parser.add_argument("receiver", nargs="?", type=_address, metavar="HOST:PORT", help="capture_node's sender/listen")
    parser.add_argument(
        "--verify",
        action="store_true",
        help="send nothing; let X-Plane print its time into the picture for a minute, read it, and report how many "
        "pictures show the frame that they are paired with",
    )
    parser.add_argument(
        "--xplane",
        type=_address,
        default=THIS_COMPUTER,
        metavar="HOST:PORT",
        help="where X-Plane listens (default: 127.0.0.1:49000)",
    )
    parser.add_argument(
        "--title",
        action="append",
        metavar="TEXT",
        help="the window's title, exactly; may be repeated (default: X-System, X-Plane)",
    )
    parser.add_argument(
        "--window",
        type=_window,
        metavar="N|X,Y",
        help="of several windows with that title: its number, counted from 0, leftmost first, then topmost; or a point "
        "of the screen that it covers, e.g. one on its monitor (default: the largest)",
    )
    parser.add_argument("--token-file", type=Path, metavar="FILE", help="holds the text of capture_node's sender/token")
    parser.add_argument("--quality", type=_within(1, 100), default=90, help="of the JPEG, 1..100 (default: 90)")
    delay = parser.add_mutually_exclusive_group()
    delay.add_argument(
        "--delay",
        type=number("seconds from -0.02 to 0.5", -0.02, 0.5),
        metavar="S",
        help="from a frame to its picture, measured before; X-Plane's field of view is then left alone",
    )
    delay.add_argument(
        "--no-calibrate",
        dest="calibrate",
        action="store_false",
        help="leave the field of view alone; each picture is flagged DELAY_ASSUMED",
    )
    delay.add_argument(
        "--calibrate-now",
        action="store_true",
        help="measure the delay also while capture_node's pictures are being recorded",
    )
    parser.add_argument(
        "--local-port",
        type=_within(0, 65535),
        default=_LOCAL_PORT,
        help="UDP port that X-Plane answers to; 0: any (default: %(default)s)",
    )
    parser.add_argument(
        "--undo-file",
        type=Path,
        default=default_undo_file(),
        metavar="FILE",
        help="keeps X-Plane's field of view while it is changed (default: %(default)s)",
    )
    return parser


def _address(text: str) -> Tuple[str, int]:
    host, colon, port = text.rpartition(":")
    if not (host and colon and port.isdecimal() and 0 < int(port) < 65536):
        raise argparse.ArgumentTypeError(f"{text!r}: expected HOST:PORT, e.g. 192.168.1.10:49790")
    return host, int(port)


def _window(text: str) -> Which:
    x, comma, y = text.partition(",")
    with contextlib.suppress(ValueError):
        if comma:
            return int(x), int(y)
        if 0 <= int(x) <= 255:
            return int(x)
    raise argparse.ArgumentTypeError(
        f"{text!r}: expected a number from 0 to 255, or a point of the screen X,Y in pixels, e.g. 1920,0"
    )


def _within(low: int, high: int) -> Callable[[str], int]:
    def convert(text: str) -> int:
        if not (text.isdecimal() and low <= int(text) <= high):
            raise argparse.ArgumentTypeError(f"{text!r}: expected a whole number from {low} to {high}")
        return int(text)

    return convert
