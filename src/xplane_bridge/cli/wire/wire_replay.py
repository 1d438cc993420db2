"""wire_replay: plays a recording of the wire to a node of the bridge, and records what the node publishes."""

from __future__ import annotations

import argparse
import hashlib
import json
import tempfile
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import yaml

from xplane_bridge.bags.chunks import BagFile
from xplane_bridge.cli.entry import guarded, positive
from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.harness.processes import interrupted_by_signals
from xplane_bridge.harness.wire_replay import Start, WireReplay
from xplane_bridge.topics import NAMESPACE
from xplane_bridge.wire_log import own_log, records
from xplane_bridge.wire_log.anonymous import anonymised
from xplane_bridge.wire_log.capture import Capture
from xplane_bridge.wire_log.own_log import OwnLog
from xplane_bridge.wire_log.strangers import StrangersCapture

#: Parameters of the recording that are not those of a replay.
_NOT_REPLAYED = ("wire_log", "wire_log_size", "wire_log_parts", "listen_for_beacon")


#: Says how a node was started, and so another thing of a replay.
_OF_THE_START = "/experiment"


class ReplayError(XplaneBridgeError):
    """A recording cannot be replayed; the text says why."""


def hashes(messages: Mapping[str, Sequence[bytes]]) -> Dict[str, str]:
    """sha256 of all payloads of each topic."""
    out = {}
    for topic, payloads in messages.items():
        digest = hashlib.sha256()
        for payload in payloads:
            digest.update(len(payload).to_bytes(4, "little") + payload)
        out[topic] = digest.hexdigest()
    return out


def compare(live: Mapping[str, Sequence[bytes]], replayed: Mapping[str, Sequence[bytes]]) -> List[Tuple[str, str]]:
    """What is to be said of each live topic; an empty word where its payloads are those of the replay.

    A recorder that came late or ended early has fewer messages; those that it has must follow each other in the replay.
    """
    out = []
    for topic, payloads in sorted(live.items()):
        here = list(replayed.get(topic, ()))
        if not payloads:
            continue
        if not here:
            out.append((topic, f"not in the replay ({len(payloads)} live)"))
            continue
        start = next((i for i, each in enumerate(here) if each == payloads[0]), None)
        if start is None:
            out.append((topic, "the first live message is not in the replay"))
            continue
        same = next(
            (i for i, each in enumerate(payloads) if start + i >= len(here) or here[start + i] != each), len(payloads)
        )
        out.append((topic, "" if same == len(payloads) else f"message {same} of {len(payloads)} differs"))
    return out


def payloads_of(bag: Path, node: str) -> Dict[str, List[bytes]]:
    """The payloads of all topics of a node in a bag."""
    file = BagFile(bag)
    try:
        out: Dict[str, List[bytes]] = {}
        for connection in file.connections.values():
            of_ros = connection.topic in ("/rosout", "/diagnostics") or connection.topic.endswith(_OF_THE_START)
            if connection.callerid == node and not of_ros:
                for _, messages in file.by_chunk(connection.id):
                    out.setdefault(connection.topic, []).extend(messages)
        return out
    finally:
        file.close()


def start_of(log: OwnLog) -> Start:
    """How the node of a log is started to replay it."""
    if not log.is_ordered:
        msg = (
            f"{log.path} holds the datagrams of {log.node} but not what else it went by: expected the log of a node "
            "that can be replayed, without lock-step"
        )
        raise ReplayError(msg)
    about: Dict[str, Any] = log.about
    shared = {key: value for key, value in about.get("shared", {}).items() if key not in _NOT_REPLAYED}
    own = {key: value for key, value in about.get("own", {}).items() if not key.startswith("wire_replay")}
    if shared.get("host"):
        # Its name may mean nothing here; only its address is in the log.
        sent = next((event for event in log.events() if event.kind == records.SENT), None)
        if sent is not None:
            shared["host"] = sent.peer[0]
    shared["listen_for_beacon"] = bool(about.get("shared", {}).get("listen_for_beacon", True))
    return Start(str(about["program"]), log.node, str(about["namespace"]), shared, own, own_log.user_files(log))


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Replays; 1 where the replay is not what was recorded."""
    p = argparse.ArgumentParser(
        prog="wire_replay",
        description="Plays a wire log of a node to the same program again, and records what it publishes.",
    )
    p.add_argument(
        "file", type=Path, help="first part of what wire_log has written, or a capture of tcpdump or Wireshark"
    )
    p.add_argument("-o", "--output", type=Path, metavar="BAG", help="bag of what the node publishes")
    p.add_argument("--against", type=Path, metavar="BAG", help="the bag of the flight: are its messages the same?")
    p.add_argument("--sent", type=Path, metavar="FILE", help="wire log of the replay itself: what the node sends")
    p.add_argument("--xplane", metavar="ADDRESS", help="of X-Plane, in a capture of another program with several")
    p.add_argument(
        "--set",
        type=_parameter,
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="a shared parameter of the node",
    )
    p.add_argument(
        "--anonymise", type=Path, metavar="FILE", help="write the recording without addresses and names, only"
    )
    p.add_argument(
        "--regression", type=Path, metavar="DIR", help="keep the recording there, anonymised, and what its replay gives"
    )
    p.add_argument("--expect", type=Path, metavar="JSON", help="what --regression has written: is it the same?")
    p.add_argument("--logs", type=Path, metavar="DIR", help="keep the logs of ROS and of the node")
    p.add_argument("--timeout", type=positive, default=3600.0, metavar="S", help="give up after this (%(default)g s)")
    args = p.parse_args(argv)
    with interrupted_by_signals("wire_replay"), tempfile.TemporaryDirectory(prefix="wire_replay_") as folder:
        return _replay(args, Path(folder))


def prepare(path: Path, file: Path, xplane: Optional[str], given: Mapping[str, Any]) -> Tuple[Start, str]:
    """Writes what the node plays.

    Args:
        path: the recording.
        file: to be written.
        xplane: address of X-Plane in another program's capture; None: found.
        given: shared parameters, in the place of those recorded.

    Returns:
        How the node is started, and what is to be said of the recording.

    Raises:
        CaptureError, ReplayError: It cannot be replayed.
    """
    if own_log.about_of(Capture.open(path)) is not None:
        log = OwnLog(path)
        start = start_of(log)
        with file.open("wb") as out:
            out.writelines(own_log.replayable(log))
        word = f"{log.problem}; the replay ends there" if log.problem else ""
        return start._replace(shared={**start.shared, **given}), word
    strange = StrangersCapture(path, xplane)
    with file.open("wb") as out:
        out.writelines(strange.playable())
    transport = "rref" if strange.answers else "data"
    shared = {"host": strange.xplane, "port": strange.port, "transport": transport, "listen_for_beacon": False}
    if transport == "data":
        shared["listen_for_beacon"] = True
    word = (
        f"X-Plane at {strange.xplane}: {strange.answers} answers with {len(strange.paths)} datarefs, {strange.rows} "
        f"datagrams of Data Output"
    )
    if strange.nameless:
        word += f"; {strange.nameless} values have no name, their requests were not captured"
    return Start("rx_node", f"{NAMESPACE}/rx_node", NAMESPACE, {**shared, **given}, {}), word


def _parameter(text: str) -> Tuple[str, Any]:
    key, equals, value = text.partition("=")
    if not equals:
        msg = f"{text!r}: expected KEY=VALUE"
        raise argparse.ArgumentTypeError(msg)
    return key, yaml.safe_load(value)


def _write_anonymised(path: Path, to: Path) -> None:
    parts = OwnLog(path).parts() if own_log.about_of(Capture.open(path)) is not None else [path]
    if len(parts) > 1:
        msg = f"{path} has {len(parts)} parts: expected a recording of one; anonymise them one by one"
        raise ReplayError(msg)
    with to.open("wb") as out:
        out.writelines(anonymised(path))


def _judge(expected: Mapping[str, Mapping[str, Any]], found: Mapping[str, Mapping[str, Any]]) -> List[Tuple[str, str]]:
    """What is to be said of each topic; an empty word where it is as expected."""
    out = []
    for topic in sorted({*expected, *found}):
        was, now = expected.get(topic), found.get(topic)
        if was is None or now is None:
            out.append((topic, "is new" if was is None else "is missing"))
        elif was != now:
            out.append((topic, f"has {now['messages']} messages, expected {was['messages']}, or others"))
        else:
            out.append((topic, ""))
    return out


def _replay(args: argparse.Namespace, folder: Path) -> int:
    if args.anonymise:
        _write_anonymised(args.file, args.anonymise)
        return 0
    if args.regression:
        args.regression.mkdir(parents=True, exist_ok=True)
        kept = args.regression / f"{args.file.name.split('.')[0]}.pcapng"
        if kept.resolve() != args.file.resolve():
            _write_anonymised(args.file, kept)
        args.file = kept
    file = folder / "records"
    start, word = prepare(args.file, file, args.xplane, dict(args.set))
    if word:
        print(f"wire_replay: {word}")
    replay = WireReplay(start, file, args.logs or folder, wire_log=args.sent)
    print(replay.run(args.timeout))
    messages: Dict[str, List[bytes]] = {}
    for message in replay.messages:
        if message.topic.endswith(_OF_THE_START):
            continue
        messages.setdefault(message.topic, []).append(message.data)
    for topic, digest in sorted(hashes(messages).items()):
        print(f"{topic}  {len(messages[topic])}  {digest[:16]}")
    found = {topic: {"messages": len(messages[topic]), "sha256": digest} for topic, digest in hashes(messages).items()}
    if args.regression:
        text = json.dumps(found, indent=2, sort_keys=True) + "\n"
        args.file.with_suffix(".json").write_text(text, encoding="utf-8")
    if args.expect:
        try:
            expected = json.loads(args.expect.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            msg = f"{args.expect} cannot be read: {error}; expected what --regression has written"
            raise ReplayError(msg) from None
        return _say(_judge(expected, found))
    if args.output:
        replay.write_bag(args.output)
    if not args.against:
        return 0
    verdicts = compare(payloads_of(args.against, start.node), messages)
    if not verdicts:
        msg = f"{args.against} has no topic of {start.node}"
        raise ReplayError(msg)
    return _say(verdicts)


def _say(verdicts: Sequence[Tuple[str, str]]) -> int:
    for topic, word in verdicts:
        print(f"{'DIFFERS' if word else 'same   '} {topic} {word}".rstrip())
    return 1 if any(word for _, word in verdicts) else 0
