#!/usr/bin/env python3
"""Gives what reads bytes and texts of others in Python changed versions of good ones, the same for the same seed.

    PYTHONPATH=src python3 tests/fuzz/fuzz_python.py --runs 2000
    PYTHONPATH=src python3 tests/fuzz/fuzz_python.py --seconds 600 --seed 7 codec

What is not understood must be refused by the error that programs show; any other is printed with its input, and the
exit code is 1.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import random
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Sequence

import yaml

from xplane_bridge import protocol
from xplane_bridge.campaign.definition import parse_campaign
from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.eye.wire import ReplyReader, WireError
from xplane_bridge.joystick.config_table import load_joy_config
from xplane_bridge.scenario.loader import parse_scenario

ROOT = Path(__file__).resolve().parents[2]
_WORDS: Sequence[Any] = (None, True, 0, -1, 1e400, float("nan"), 10**400, "", "x", [], {}, [[]], {"at": 0}, "0", 0.5)
_BOUNDARY_WORDS = (
    b"\0\0\0\0",
    b"\xff\xff\xff\x7f",
    b"\0\0\0\x80",
    b"\xff\xff\xff\xff",
    b"\0\0\xc0\x7f",
    b"\0\0\x80\x7f",
)


class Target(NamedTuple):
    """Inputs, and the decoder for each."""

    seeds: Callable[[], List[Any]]
    change: Callable[[Any, List[Any], random.Random], Any]
    take: Callable[[Any], None]


def changed_bytes(seed: bytes, seeds: List[bytes], chance: random.Random) -> bytes:
    """With one to eight changes: bytes put in, overwritten, cut off, taken out, or from another seed."""
    data = bytearray(seed)
    for _ in range(chance.randint(1, 8)):
        at, length = chance.randrange(len(data) + 1), chance.randrange(1, 9)
        kind = chance.randrange(6)
        if kind == 0:
            data[at:at] = bytes(chance.randrange(256) for _ in range(length))
        elif kind == 1:
            data[at : at + 1] = bytes([chance.randrange(256)])
        elif kind == 2:
            del data[at:]
        elif kind == 3:
            del data[at : at + length]
        elif kind == 4:
            data[at : at + 4] = chance.choice(_BOUNDARY_WORDS)
        else:
            other = chance.choice(seeds)
            start = chance.randrange(len(other) + 1)
            data[at:at] = other[start : start + 8 * length]
    return bytes(data)


def changed_document(seed: str, _seeds: List[str], chance: random.Random) -> Any:
    """The YAML document with one to four of its values replaced, taken away or doubled."""
    document = yaml.safe_load(seed)
    for _ in range(chance.randint(1, 4)):
        node, parents = document, []
        while isinstance(node, (dict, list)) and node and (not parents or chance.random() < 0.8):
            key = chance.choice(list(node)) if isinstance(node, dict) else chance.randrange(len(node))
            parents.append((node, key))
            node = node[key]
        if not parents:
            return chance.choice(_WORDS)
        holder, key = parents[-1]
        kind = chance.randrange(4)
        if kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(holder, dict):
            holder[chance.choice(["x", 7, "at", "name", "axes"])] = holder[key]
        elif kind == 2 and isinstance(holder, list):
            holder.append(holder[key])
        else:
            # Never the same object twice: a later change would go in a circle.
            holder[key] = json.loads(json.dumps(chance.choice(_WORDS)))
    return document


def _codec(data: bytes) -> None:
    for decode in (
        protocol.decode_request,
        protocol.decode_data,
        protocol.decode_beacon,
        protocol.decode_dref_response,
        protocol.decode_rpos_response,
        protocol.decode_rref_response,
    ):
        with contextlib.suppress(protocol.DecodeError):
            decode(data)


def _packets() -> List[bytes]:
    return [bytes.fromhex(file.read_text()) for file in sorted((ROOT / "tests/data/packets").glob("*.hex"))]


def _texts(*folders: str) -> List[str]:
    return [file.read_text(encoding="utf-8") for f in folders for file in sorted((ROOT / f).glob("*.yaml"))]


def _replies(data: bytes) -> None:
    with contextlib.suppress(WireError):
        ReplyReader().feed(data)


def _refusing(take: Callable[[Any], Any]) -> Callable[[Any], None]:
    def taking(document: Any) -> None:
        try:
            take(document)
        except XplaneBridgeError as error:
            if not str(error):
                raise AssertionError("refused without a word") from error

    return taking


def _joystick(document: Any) -> None:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "joystick.yaml"
        file.write_text(yaml.safe_dump(document), encoding="utf-8")
        load_joy_config(file)


TARGETS: Dict[str, Target] = {
    "codec": Target(_packets, changed_bytes, _codec),
    "eye": Target(lambda: [b"", *_packets()], changed_bytes, _replies),
    "scenario": Target(lambda: _texts("config/scenarios"), changed_document, _refusing(parse_scenario)),
    "campaign": Target(lambda: _texts("config/campaigns"), changed_document, _refusing(parse_campaign)),
    "joystick": Target(lambda: _texts("config/joysticks"), changed_document, _refusing(_joystick)),
}


def fuzz(name: str, seed: int, runs: float, seconds: float) -> int:
    """Gives a target so many inputs, or for so long; returns how many.

    Raises:
        AssertionError: One was not refused as it should be; the message has its seed, run and input.
    """
    target = TARGETS[name]
    seeds = target.seeds()
    assert seeds, f"{name}: no seeds"
    end, run = time.monotonic() + seconds, 0
    while run < runs and time.monotonic() < end:
        chance = random.Random(f"{name} {seed} {run}")
        given = target.change(chance.choice(seeds), seeds, chance)
        try:
            target.take(given)
        except Exception:
            raise AssertionError(f"{name}, seed {seed}, run {run}: {given!r}\n{traceback.format_exc()}") from None
        run += 1
    return run


def main() -> int:
    """Runs the program."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=f"of {', '.join(TARGETS)} (default: all)")
    parser.add_argument("--runs", type=float, default=float("inf"), help="inputs of each target")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="of each target")
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    unknown = sorted(set(args.targets) - set(TARGETS))
    if unknown:
        parser.error(f"no target {', '.join(unknown)}; there are: {', '.join(TARGETS)}")
    if args.runs == args.seconds == float("inf"):
        parser.error("give --runs or --seconds")
    for name in args.targets or TARGETS:
        try:
            print(f"{name}: {fuzz(name, args.seed, args.runs, args.seconds)} inputs")
        except AssertionError as error:
            print(error, file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
