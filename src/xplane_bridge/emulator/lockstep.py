"""Lock-step on the wire: every frame ends with a fence on every client's socket, and waits for one that comes back.

The fence is a dataref that no X-Plane has, `FENCE`: its elements are the frame's number, whole seconds and microseconds
of simulated time, and the number of the frame that the window shows, each exact in float32. Who subscribes to it, at
whatever rate, gets it after everything else that is sent in a frame, when its picture is drawn. A program with many
sockets names the port of one of them by `GROUP`: that one gets every fence, as the last of them; the others get it in
frames that send them something, at the end of that datagram. A DREF that writes a frame's number to the fence lets the
simulator fly on from that frame; the program that writes it gets its frames first: it has read them when the others
have answered.

Frame 0 does not fly: it is sent again and again, in real time, until it is answered, so that clients can subscribe.
When the last client has ended its fences, the next run begins with a frame 0 of its own.
"""

from __future__ import annotations

import math
import re
import select
import time
from typing import Callable, Dict, List, Optional, Sequence, Tuple

from xplane_bridge import protocol
from xplane_bridge.emulator.wire.server import Server
from xplane_bridge.emulator.wire.subscriptions import Address, Datagram

FENCE = "xplane_bridge/lockstep"
#: Its element is the port of the group's first socket; its value, how many sockets of the group get this fence.
GROUP = "xplane_bridge/lockstep_group"
#: Of a client: its index and the element; that of the group is negative.
Pairs = Tuple[Tuple[int, int], ...]
#: Of a datagram: its receiver, its label, its length.
Shape = Tuple[Address, bytes, int]
#: Receiver, which datagram of the frame (None: none), and the fence at its end: pairs, and how many sockets get it.
_Place = Tuple[Address, Optional[int], Optional[Tuple[Pairs, int]]]
_GROUP = re.compile(re.escape(GROUP) + r"\[(\d{1,5})\]")
_SOCKETS = -1
_ELEMENT = re.compile(re.escape(FENCE) + r"(?:\[([0-3])\])?")
_MICROSECONDS = 1_000_000
#: RREF datagram [bytes].
_PAIR_SIZE = protocol.RREF_PAIR_SIZE
_LONGEST = protocol.HEADER_SIZE + protocol.RREF_MAX_PAIRS * _PAIR_SIZE
#: Of frames whose datagrams are alike, so many layouts are kept.
_MOST_LAYOUTS = 256
#: Longest wait without looking whether to stop [s].
_PATIENCE_S = 0.25


class Fences:
    """Who wants fences, and which frame was answered last."""

    def __init__(self) -> None:
        self.answered = -1  #: number of the newest frame that may be left; -1: none, a run begins
        self._clients: Dict[Address, Dict[int, int]] = {}  # of a client: its index to the element
        self._groups: Dict[Address, Address] = {}  # of a client: the first socket of its group
        self._always: List[Address] = []  # who gets every fence: first sockets of groups, and those of no group
        self._answers: Optional[Address] = None  # who wrote the newest answer
        self._pairs: Dict[Address, Pairs] = {}
        self._layouts: Dict[Tuple[Shape, ...], List[_Place]] = {}

    def request(self, request: protocol.RrefRequest, client: Address) -> bool:
        """Takes a subscription or its end; returns whether it is one of the fence."""
        match, group = _ELEMENT.fullmatch(request.path), _GROUP.fullmatch(request.path)
        if match is None and group is None:
            return False
        indices = self._clients.setdefault(client, {})
        if request.rate_hz > 0:
            indices[request.index] = _SOCKETS if match is None else int(match.group(1) or 0)
            if group is not None:
                self._groups[client] = (client[0], int(group.group(1)))
        elif indices.pop(request.index, None) == _SOCKETS:
            self._groups.pop(client, None)
        if not indices:
            del self._clients[client]
            if not self._clients:
                self.answered, self._answers = -1, None
        self._pairs = {each: tuple(elements.items()) for each, elements in self._clients.items()}
        self._always = [each for each in self._clients if self._groups.get(each, each) == each]
        self._layouts.clear()
        return True

    def write(self, request: protocol.DrefWrite, client: Address) -> bool:
        """Takes the answer to a frame; returns whether it is one."""
        if not request.path.startswith(FENCE) or _ELEMENT.fullmatch(request.path) is None:
            return False
        # Before frame 0 is answered, an answer to another frame is one to a run that has ended.
        if math.isfinite(request.value) and (self.answered >= 0 or request.value < 1.0):
            self.answered = max(self.answered, int(request.value))
            if client != self._answers:
                self._answers = client
                self._layouts.clear()
        return True

    def awaits(self, frame: int) -> bool:
        """Whether the answer to this frame is still to come; not to one whose clients have all left."""
        return self.answered < frame and (frame == 0 or self.answered >= 0)

    def send(self, server: Server, now: float, frame: int, sim_time: float, picture: int = 0) -> None:
        """Ends a frame: sends what the server has held of it, with the fences.

        Args:
            server: The sockets.
            now: Time of the frame on the loop's clock [s].
            frame: Its number.
            sim_time: Simulated time [s].
            picture: Number of the frame that the window shows; 0: none.
        """
        microseconds = round(sim_time * _MICROSECONDS)
        seconds, rest = divmod(microseconds, _MICROSECONDS)
        values = (float(frame), float(seconds), float(rest), float(picture))
        server.send_all(now, self._ended(server.take_held(), values))

    def _ended(self, datagrams: List[Datagram], values: Tuple[float, ...]) -> List[Datagram]:
        """A frame's datagrams with the fences behind them."""
        shapes = tuple((client, packet[:4], len(packet)) for packet, client in datagrams)
        layout = self._layouts.get(shapes)
        if layout is None:
            if len(self._layouts) >= _MOST_LAYOUTS:
                self._layouts.clear()
            layout = self._layouts[shapes] = self._lay_out(shapes)
        fences: Dict[Tuple[Pairs, int], bytes] = {}  # few: clients ask for the elements alike
        out: List[Datagram] = []
        for client, place, ending in layout:
            packet = b"" if place is None else datagrams[place][0]
            if ending is not None:
                if ending not in fences:
                    pairs, count = ending
                    elements = (*values, float(count))  # its last is that of _SOCKETS
                    fences[ending] = protocol.encode_rref_response([(i, elements[element]) for i, element in pairs])
                packet = packet + fences[ending][protocol.HEADER_SIZE :] if packet else fences[ending]
            out.append((packet, client))
        return out

    def _lay_out(self, shapes: Sequence[Shape]) -> List[_Place]:
        """What is sent in which order: program by program, first that which answers the frame."""
        programs: Dict[Address, List[int]] = {first: [] for first in self._always}  # places of its datagrams
        for place, (client, _, _) in enumerate(shapes):
            programs.setdefault(self._groups.get(client, client), []).append(place)
        answering = None if self._answers is None else self._groups.get(self._answers, self._answers)
        out: List[_Place] = []
        for first in sorted(programs, key=lambda each: each != answering):
            places = sorted(programs[first], key=lambda place: shapes[place][0] == first)
            endings = {shapes[place][0]: place for place in places if shapes[place][0] in self._groups}
            endings.pop(first, None)
            count = len(endings) + (first in self._always)
            alone: List[_Place] = []
            for place in places:
                client, label, size = shapes[place]
                ending = (self._pairs[client], count) if endings.get(client) == place else None
                if ending is not None and (label != b"RREF" or size + _PAIR_SIZE * len(ending[0]) > _LONGEST):
                    alone.append((client, None, ending))
                    ending = None
                out.append((client, place, ending))
            out += alone
            if first in self._always:
                out.append((first, None, (self._pairs[first], count)))
        return out


class LockstepLoop:
    """Flies a frame whenever the one before was answered.

    Args:
        server: Gives the sockets.
        fences: Of these.
        begin: Called when a run begins: its frames are numbered from 1.
        fly: Flies a frame and sends what is due in it.
        after_fence: Does what remains of a frame, while clients answer it.
        hold: Sends what is due without flying; gets the time on the loop's clock [s].
        sim_time: Gives the simulated time [s].
        picture: Gives the number of the frame that the window shows; 0: none.
        idle: Called now and then while answers are awaited.
        period: Time of one frame [s].
        pace: Simulated time may go by so many times faster than real time; 0: as fast as it goes.
    """

    def __init__(
        self,
        server: Callable[[], Server],
        fences: Fences,
        begin: Callable[[], None],
        fly: Callable[[], None],
        after_fence: Callable[[], None],
        hold: Callable[[float], None],
        sim_time: Callable[[], float],
        picture: Callable[[], int],
        idle: Callable[[], None],
        period: float,
        pace: float = 0.0,
    ) -> None:
        self._server = server
        self._fences = fences
        self._begin = begin
        self._fly = fly
        self._after_fence = after_fence
        self._hold = hold
        self._sim_time = sim_time
        self._picture = picture
        self._idle = idle
        self._period = period
        self._pace = pace
        self.waited = 0.0  #: [s] of wall time for answers to frames that were flown

    def run(self, frames: Optional[int], stopping: Callable[[], bool]) -> None:
        """Flies so many frames; None: until `stopping` says so."""
        flown = 0
        while (frames is None or flown < frames) and not stopping():
            self._hold_frame_0(stopping)
            flown += self._fly_run(None if frames is None else frames - flown, stopping)

    def _hold_frame_0(self, stopping: Callable[[], bool]) -> None:
        """Begins a run: repeats frame 0 until it is answered."""
        self._begin()
        self._server().restart_pacers()
        held = 0
        while self._fences.awaits(0) and not stopping():
            self._hold(held * self._period)
            self._fences.send(self._server(), held * self._period, 0, self._sim_time())
            held += 1
            self._await(0, self._period, stopping)
        self._server().restart_pacers()

    def _fly_run(self, frames: Optional[int], stopping: Callable[[], bool]) -> int:
        """Flies so many frames, or until all clients have left; returns how many it has flown."""
        began, frame = time.monotonic(), 0
        while (frames is None or frame < frames) and self._fences.answered >= 0 and not stopping():
            frame += 1
            if self._pace > 0.0:
                time.sleep(max(0.0, began + frame * self._period / self._pace - time.monotonic()))
            self._fly()
            if self._fences.answered < 0:  # all have left since the frame before it was answered
                self._server().take_held()
                self._after_fence()
                return frame
            self._fences.send(self._server(), frame * self._period, frame, self._sim_time(), self._picture())
            sent = time.monotonic()
            self._after_fence()
            while self._fences.awaits(frame) and not stopping():
                self._await(frame, _PATIENCE_S, stopping)
            self.waited += time.monotonic() - sent
        return frame

    def _await(self, frame: int, patience: float, stopping: Callable[[], bool]) -> None:
        """Takes what clients send until the answer to this frame, so long at most [s]."""
        end = time.monotonic() + patience
        server = self._server()
        while not stopping() and self._fences.awaits(frame):
            self._idle()
            left = end - time.monotonic()
            if left <= 0.0:
                return
            if select.select([server], [], [], left)[0]:
                server.receive(enough=lambda: not self._fences.awaits(frame))
