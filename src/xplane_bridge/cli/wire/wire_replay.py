"""wire_replay: plays a recording of the wire to a node of the bridge, and records what the node publishes."""

from __future__ import annotations

import argparse
import hashlib
import json
import tempfile
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import yaml

from xplane_bridge.bags.chunks import BagFile
from xplane_bridge.cli.entry import guarded, positive, writing
from xplane_bridge.errors import XplaneBridgeError, yaml_problem
from xplane_bridge.harness.processes import interrupted_by_signals
from xplane_bridge.harness.wire_replay import Start, WireReplay
from xplane_bridge.topics import NAMESPACE
from xplane_bridge.wire_log import own_log, records
from xplane_bridge.wire_log.anonymous import Anonymiser, is_address
from xplane_bridge.wire_log.capture import Capture
from xplane_bridge.wire_log.own_log import OwnLog
from xplane_bridge.wire_log.strangers import StrangersCapture

#: Parameters of the recording that are not those of a replay.
_NOT_REPLAYED = ("wire_log", "wire_log_size", "wire_log_parts", "listen_for_beacon")


#: Says how a node was started, and so another thing of a replay.
_OF_THE_START = "/experiment"
#: That it has a subscriber is this input of a log. Where the log has none (an earlier version's, or a later part), the
#: replay does not ask X-Plane for it.
_ON_DEMAND, _DEMAND = "/traffic/state", "traffic wanted"
#: Options beside which --anonymise would leave them undone.
_OF_A_REPLAY = ("output", "against", "sent", "xplane", "set", "regression", "expect", "logs")
#: Of the names of captures.
_ENDINGS = (".pcapng", ".pcap", ".cap")
#: Where something cannot be written.
_REMEDY = "give a folder that can be"


class ReplayError(XplaneBridgeError):
    """A recording cannot be replayed; the text says why."""


class Options(NamedTuple):
    """What a replay goes by beside the recording."""

    xplane: Optional[str]  #: address of X-Plane in another program's capture; None: found
    given: Mapping[str, Any]  #: shared parameters, in the place of those recorded

    def over(self, kept: Options) -> Options:
        """These, and of those kept what is not given anew."""
        return Options(self.xplane or kept.xplane, {**kept.given, **self.given})


class Expected(NamedTuple):
    """What --regression has written."""

    options: Options
    topics: Mapping[str, Any]


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
        same = _longest_run(payloads, here)
        if same == 0:
            out.append((topic, "the first live message is not in the replay"))
        else:
            out.append((topic, "" if same == len(payloads) else f"message {same} of {len(payloads)} differs"))
    return out


def _longest_run(payloads: Sequence[bytes], here: Sequence[bytes]) -> int:
    """How many of the first payloads follow each other somewhere in these (Knuth, Morris and Pratt).

    Values repeat: the first payload may be there many times, and the run begin at any of them.
    """
    fallback, length = [0] * len(payloads), 0
    for i in range(1, len(payloads)):
        while length and payloads[i] != payloads[length]:
            length = fallback[length - 1]
        length += payloads[i] == payloads[length]
        fallback[i] = length
    best = length = 0
    for each in here:
        while length and each != payloads[length]:
            length = fallback[length - 1]
        length += each == payloads[length]
        best = max(best, length)
        if best == len(payloads):
            break
    return best


def payloads_of(bag: Path, node: str) -> Dict[str, List[bytes]]:
    """The payloads of all topics of a node in a bag, in the order in which they were recorded."""
    try:
        file = BagFile(bag)
    except OSError as error:
        msg = f"{bag} cannot be read: {error.strerror}; expected the bag of the flight"
        raise ReplayError(msg) from None
    try:
        found: Dict[str, List[Tuple[int, bytes]]] = {}
        for connection in file.connections.values():
            of_ros = connection.topic in ("/rosout", "/diagnostics") or connection.topic.endswith(_OF_THE_START)
            if connection.callerid == node and not of_ros:
                payloads = (payload for _, chunk in file.by_chunk(connection.id) for payload in chunk)
                # The index is in order of time in each chunk, and with use_sim_time that goes back.
                placed = zip(file.places(connection.id).tolist(), payloads)
                found.setdefault(connection.topic, []).extend(placed)
        return {topic: [payload for _, payload in sorted(placed)] for topic, placed in found.items()}
    finally:
        file.close()


def asks_on_demand(path: Path) -> bool:
    """Whether a replay of the recording asks for other aircraft where the node did."""
    return _is_own(path) and own_log.has_input(OwnLog(path), _DEMAND)


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
    p.add_argument(
        "--xplane", type=_address, metavar="ADDRESS", help="of X-Plane, in a capture of another program with several"
    )
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
    if _is_own(path):
        log = OwnLog(path)
        start = start_of(log)
        with file.open("wb") as out:
            out.writelines(own_log.replayable(log))
        word = f"{log.problem}; the replay ends there" if log.problem else ""
        return start._replace(shared={**start.shared, **given}), word
    strange = StrangersCapture(path, xplane)
    with file.open("wb") as out:
        out.writelines(strange.playable())
    transport = given.get("transport", "rref" if strange.answers else "data")
    shared = {"host": strange.xplane, "port": strange.port, "transport": transport}
    shared["listen_for_beacon"] = transport == "data"
    word = (
        f"X-Plane at {strange.xplane}: {strange.answers} answers with {len(strange.paths)} datarefs, {strange.rows} "
        f"datagrams of Data Output"
    )
    if strange.rows and transport != "data":
        word += ", which are not replayed beside answers (--set transport=data takes them instead)"
    if strange.nameless:
        word += f"; {strange.nameless} values have no name, their requests were not captured"
    word = "; ".join([word, *strange.left_out()])
    return Start("rx_node", f"{NAMESPACE}/rx_node", NAMESPACE, {**shared, **given}, {}), word


def _is_own(path: Path) -> bool:
    return own_log.about_of(Capture.open(path)) is not None


def _parameter(text: str) -> Tuple[str, Any]:
    key, equals, value = text.partition("=")
    if not equals:
        msg = f"{text!r}: expected KEY=VALUE"
        raise argparse.ArgumentTypeError(msg)
    try:
        return key, yaml.safe_load(value)
    except yaml.YAMLError as error:
        msg = f"{text!r}: the value {yaml_problem(error)}"
        raise argparse.ArgumentTypeError(msg) from None


def _address(text: str) -> str:
    if not is_address(text):
        msg = f"{text!r}: expected an IPv4 address, such as 192.168.1.5"
        raise argparse.ArgumentTypeError(msg)
    return text


def _write_anonymised(path: Path, to: Path, written: List[Path]) -> Anonymiser:
    """Writes a recording's parts in one disguise.

    Args:
        path: the first part.
        to: where it goes; the others go beside it, named as parts are.
        written: gets the files as they are begun.

    Raises:
        CaptureError, ReplayError: It cannot be read, or something is there already.
    """
    is_own = _is_own(path)
    parts = OwnLog(path).parts() if is_own else [path]
    outputs = [to, *(own_log.part_after(to, count) for count in range(1, len(parts)))]
    # Of a wire log a reader would take one more for the next part.
    for there in (*outputs, own_log.part_after(to, len(parts)) if is_own else to):
        if there.exists():
            msg = f"{there} is there already and is kept: delete it, or write {path} elsewhere than to {to}"
            raise ReplayError(msg)
    anonymiser = Anonymiser(parts)
    for part, output in zip(parts, outputs):
        try:
            with output.open("xb") as out:
                written.append(output)
                out.writelines(anonymiser.blocks(part))
        except OSError as error:
            msg = f"{output} cannot be written: {error.strerror}; give a folder that is there and can be written"
            raise ReplayError(msg) from None
    for word in anonymiser.left_out():
        print(f"wire_replay: {word}")
    return anonymiser


def _keep(path: Path, to: Path, options: Options, written: List[Path]) -> Options:
    """Writes a recording as a regression test's; returns the options that mean the same there.

    Raises:
        CaptureError, ReplayError: It cannot be read, something is there already, or X-Plane is not in it.
    """
    if to.resolve() == path.resolve():
        if not to.with_suffix(".json").is_file():
            msg = f"{path} lies in {to.parent} itself, where it would stay with all addresses: give another folder"
            raise ReplayError(msg)
        return options.over(_expectation(to.with_suffix(".json")).options)
    if to.with_suffix(".json").exists():
        msg = (
            f"{path} would be kept as {to}, and {to.with_suffix('.json')} is there already: give another folder, "
            f"delete both, or replay {to} itself with --regression to make its JSON file anew"
        )
        raise ReplayError(msg)
    disguise = _write_anonymised(path, to, written).disguise
    if options.xplane and not disguise.knows(options.xplane):
        msg = f"--xplane {options.xplane}: {path} has no datagram from or to it; expected the address of X-Plane there"
        raise ReplayError(msg)
    xplane = disguise.address(options.xplane) if options.xplane else None
    return Options(xplane, {key: disguise.word(value) for key, value in options.given.items()})


def _kept_name(path: Path) -> str:
    """Of a recording in a folder of regression tests: node, run and part stay in it."""
    ending = next((each for each in _ENDINGS if path.name.lower().endswith(each)), "")
    return path.name[: len(path.name) - len(ending)] + _ENDINGS[0]


def _expectation(path: Path) -> Expected:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        options = content["options"]
        return Expected(Options(options["xplane"], dict(options["set"])), dict(content["topics"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        msg = f"{path} cannot be read: {error!r}; expected what --regression has written"
        raise ReplayError(msg) from None


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
    written: List[Path] = []  # and of no use, unless all goes well
    try:
        if args.anonymise:
            given = next((name for name in _OF_A_REPLAY if getattr(args, name)), None)
            if given is not None:
                msg = f"--{given}: not with --anonymise {args.anonymise}, which replays nothing: leave one of them out"
                raise ReplayError(msg)
            _write_anonymised(args.file, args.anonymise, written)
            return 0
        return _play(args, folder, written)
    except BaseException:
        for path in written:
            path.unlink(missing_ok=True)
        raise


def _play(args: argparse.Namespace, folder: Path, written: List[Path]) -> int:
    path, options = args.file, Options(args.xplane, dict(args.set))
    if args.xplane and _is_own(path):
        msg = (
            f"--xplane {args.xplane}: only with a capture of another program, and {path} is a wire log of the bridge, "
            "which has X-Plane's address itself: leave it out"
        )
        raise ReplayError(msg)
    if args.output and args.output.exists():
        msg = f"--output {args.output}: is there already and is kept: delete it, or give another name"
        raise ReplayError(msg)
    for option, made in (("--output", args.output and args.output.parent), ("--regression", args.regression)):
        if made:
            with writing(ReplayError, f"{option}: {made} cannot be written", _REMEDY):
                made.mkdir(parents=True, exist_ok=True)
    if args.regression:
        path = args.regression / _kept_name(args.file)
        options = _keep(args.file, path, options, written)
    expected = _expectation(args.expect) if args.expect else None
    if expected is not None:
        options = options.over(expected.options)
    file = folder / "records"
    start, word = prepare(path, file, options.xplane, options.given)
    replay = WireReplay(start, file, args.logs or folder, wire_log=args.sent)
    try:
        print(replay.run(args.timeout))
    finally:
        if word:
            print(f"wire_replay: {word}")
    messages: Dict[str, List[bytes]] = {}
    for message in replay.messages:
        if message.topic.endswith(_OF_THE_START):
            continue
        messages.setdefault(message.topic, []).append(message.data)
    for topic, digest in sorted(hashes(messages).items()):
        print(f"{topic}  {len(messages[topic])}  {digest[:16]}")
    found = {topic: {"messages": len(messages[topic]), "sha256": digest} for topic, digest in hashes(messages).items()}
    if args.regression:
        kept = {"options": {"xplane": options.xplane, "set": dict(options.given)}, "topics": found}
        text = json.dumps(kept, indent=2, sort_keys=True) + "\n"
        made = path.with_suffix(".json")
        with writing(ReplayError, f"--regression: {made} cannot be written", _REMEDY):
            made.write_text(text, encoding="utf-8")
        written.clear()
    if args.output:
        with writing(ReplayError, f"--output: {args.output} cannot be written", _REMEDY):
            replay.write_bag(args.output)
    code = 0 if expected is None else _say(_judge(expected.topics, found))
    if not args.against:
        return code
    live = payloads_of(args.against, start.node)
    on_demand = [topic for topic in live if topic.endswith(_ON_DEMAND)]
    if on_demand and not asks_on_demand(path):  # which may have to read the whole log
        for topic in on_demand:
            del live[topic]
    verdicts = compare(live, messages)
    if not verdicts:
        msg = f"{args.against} has no topic of {start.node}"
        raise ReplayError(msg)
    return max(code, _say(verdicts))


def _say(verdicts: Sequence[Tuple[str, str]]) -> int:
    for topic, word in verdicts:
        print(f"{'DIFFERS' if word else 'same   '} {topic} {word}".rstrip())
    return 1 if any(word for _, word in verdicts) else 0
