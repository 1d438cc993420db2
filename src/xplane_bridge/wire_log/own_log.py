"""What the bridge wrote with `wire_log`: all that a node did at its wire, in the order in which it did it."""

from __future__ import annotations

import re
import xmlrpc.client
from pathlib import Path, PurePosixPath
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple

from xplane_bridge.wire_log import records
from xplane_bridge.wire_log.capture import Capture, CaptureError, Packet
from xplane_bridge.wire_log.datagrams import USER0, Address, datagram_in

#: Inputs of that name are files.
USER_FILE = b"file "
#: Of what the head says.
_END = "</value>"
_PART = re.compile(r"_part(\d+)$")


class Event(NamedTuple):
    """One record of the log."""

    kind: int  #: as in `records`
    number: int  #: in the order of processing
    source: int = 0
    wall_ns: int = 0
    steady_ns: int = 0
    kernel_ns: int = 0
    peer: Address = ("0.0.0.0", 0)
    counted: int = 0
    payload: bytes = b""


class OwnLog:
    """The wire log of one node, with all of its parts.

    Args:
        path: the first part, or a later one; those that follow it are read as well.

    Raises:
        CaptureError: It is no wire log of the bridge.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        first = Capture.open(path)
        about = about_of(first)
        if about is None:
            msg = f"{path} was not written with wire_log"
            raise CaptureError(msg)
        self.about = about
        self.problem = ""  #: why the log ends before its node did; known once events() is through
        self.sources: List[Tuple[str, int]] = []  #: name and port, by number

    @property
    def node(self) -> str:
        """The node's full name."""
        return str(self.about["node"])

    @property
    def is_ordered(self) -> bool:
        """Whether it holds all that the node went by, not datagrams alone."""
        return bool(self.about.get("ordered"))

    def parts(self) -> List[Path]:
        """The files of the log, from the one given on."""
        out = [self.path]
        while (following := part_after(self.path, len(out))).is_file():
            out.append(following)
        return out

    def events(self) -> Iterator[Event]:
        """The records, up to the first gap.

        Where the first part is gone, a replay opens its sources at other times than the node did, and the log does not
        say which were closed before: all sources of a name are one.

        Raises:
            CaptureError: A part is damaged.
        """
        self.sources, self.problem = [], ""
        dropped: Dict[int, int] = {}
        numbers: List[int] = []  # of the source, by interface
        number: Optional[int] = None
        begins_late = False
        for part in self.parts():
            capture = Capture.open(part)
            for packet in capture.packets():
                notes = dict(item.split("=", 1) for item in packet.comment.split(" ") if "=" in item)
                if "n" not in notes:
                    self.problem = f"{part} was changed by another program: a packet has no number"
                    return
                if number is not None and int(notes["n"]) != number:
                    self.problem = f"{part} has a gap before packet {notes['n']}: packets were taken out"
                    return
                begins_late = begins_late or (number is None and notes["n"] != "0")
                yield from self._opened(capture, numbers, begins_late)
                for times in filter(None, notes.get("t", "").split(";")):
                    wall, steady = times.split(",")
                    yield Event(records.WAITED, int(notes["n"]), wall_ns=int(wall), steady_ns=int(steady))
                event = self._event(capture, packet, notes, numbers, dropped)
                number = int(notes["n"]) + 1
                if event.kind == records.LOST:
                    self.problem = f"{part} has a gap of {event.counted} records, which were not written in time"
                    return
                if event.kind:
                    yield event
            yield from self._opened(capture, numbers, begins_late)
            if capture.cut:
                self.problem = f"{part} is cut off"
                return

    def _opened(self, capture: Capture, numbers: List[int], by_name: bool) -> Iterator[Event]:
        """Sources that the part has named since the last call, and no earlier part."""
        for interface in capture.interfaces[1 + len(numbers) :]:
            name = interface.name.partition("/")[2]
            names = [known for known, _ in self.sources]
            if by_name and name in names:
                numbers.append(names.index(name))
                continue
            source = len(names)
            numbers.append(source)
            self.sources.append((name, interface.port))
            yield Event(records.OPENED, 0, source=source, peer=("0.0.0.0", interface.port), payload=name.encode())

    @staticmethod
    def _event(
        capture: Capture, packet: Packet, notes: Dict[str, str], numbers: List[int], dropped: Dict[int, int]
    ) -> Event:
        number, wall, steady = int(notes["n"]), int(notes["w"]), int(notes["s"])
        link_type = capture.interfaces[packet.interface].link_type
        if link_type == USER0:
            name, _, rest = packet.data.partition(b"\0")
            if name == b"waited":
                return Event(0, number)
            if name in (b"lost", b"refused"):
                count, place = rest.split()
                if name == b"lost":
                    return Event(records.LOST, number, 0, wall, steady, counted=int(count))
                return Event(records.REFUSED, number, numbers[int(place)], wall, steady, counted=int(count))
            return Event(records.INPUT, number, 0, wall, steady, payload=packet.data)
        datagram = datagram_in(link_type, packet.data)
        if datagram is None:
            return Event(0, number)
        source = numbers[packet.interface - 1]
        if packet.outbound:
            refused = int(notes.get("e", "0"))
            return Event(records.SENT, number, source, wall, steady, 0, datagram.destination, refused, datagram.payload)
        dropped[source] = dropped.get(source, 0) + packet.dropped
        kernel = packet.time_ns if "k" in notes else 0
        return Event(
            records.RECEIVED, number, source, wall, steady, kernel, datagram.source, dropped[source], datagram.payload
        )


def part_after(path: Path, count: int) -> Path:
    """Where the part of a wire log lies that comes so many parts after this one."""
    match = _PART.search(path.stem)
    number = int(match.group(1)) if match else 1
    stem = path.stem[: match.start()] if match else path.stem
    return path.with_name(f"{stem}_part{number + count}{path.suffix}")


def about_of(capture: Capture) -> Optional[Dict[str, Any]]:
    """What the head of a wire log says of its node; None of another capture."""
    for _ in capture.packets():
        break
    if not capture.comment.startswith("<value><struct>"):
        return None
    end = capture.comment.rfind(_END) + len(_END)  # other programs add comments of their own
    text = f"<methodResponse><params><param>{capture.comment[:end]}</param></params></methodResponse>"
    try:
        value = xmlrpc.client.loads(text)[0][0]
    except Exception as error:  # expat's and xmlrpc's own, of all kinds
        msg = f"{capture.name} has a damaged head: {error}"
        raise CaptureError(msg) from None
    return value if isinstance(value, dict) and "node" in value else None


def user_files(log: OwnLog) -> Dict[str, bytes]:
    """What earlier flights had left for the node, in its folder of the user, by path there."""
    out: Dict[str, bytes] = {}
    for event in log.events():
        name, _, content = event.payload.partition(b"\0")
        if event.kind == records.INPUT and name.startswith(USER_FILE):
            path = PurePosixPath(name[len(USER_FILE) :].decode())
            if path.is_absolute() or ".." in path.parts:
                msg = f"{log.path} has a file {path}: expected a path in the node's folder"
                raise CaptureError(msg)
            out[str(path)] = content
        elif event.kind == records.RECEIVED:
            break
    return out


def has_input(log: OwnLog, name: str) -> bool:
    """Whether the node has had an input of that name."""
    begin = name.encode() + b"\0"
    return any(event.kind == records.INPUT and event.payload.startswith(begin) for event in log.events())


def replayable(log: OwnLog) -> Iterator[bytes]:
    """The file that a node plays, in pieces."""
    yield records.MAGIC
    for event in log.events():
        yield records.encode(
            event.kind,
            event.payload,
            event.source,
            event.wall_ns,
            event.steady_ns,
            event.kernel_ns,
            event.peer,
            event.counted,
        )
