"""How X-Plane answers requests for datarefs."""

from __future__ import annotations

import time
from typing import Dict, List, Sequence, Tuple

from xplane_bridge import protocol
from xplane_bridge.doctor import names as doctor_names
from xplane_bridge.doctor.conformance import names
from xplane_bridge.doctor.conformance.flight import Flight
from xplane_bridge.doctor.conformance.link import FAST_HZ
from xplane_bridge.doctor.conformance.question import Question
from xplane_bridge.doctor.conformance.verdict import Answer, judged

#: What the nodes send at a time, and what other clients found to be the most in one frame.
_BATCH, _MOST = 100, 148
_WATCH_S = 1.0
#: As the nodes ask for a value each frame [1/s].
_EVERY_FRAME = 1000
#: The least part of the frames that says "every frame": some datagrams are lost on a busy computer.
_SHARE = 0.7
#: Between two questions, so that the requests of one do not count as the other's [s].
_APART_S = 0.2
#: A name that no X-Plane has.
_UNKNOWN = "sim/none"


def _answers(flight: Flight, requests: Sequence[protocol.RrefRequest]) -> List[List[Tuple[int, float]]]:
    """Pairs of each datagram that comes within a second after these requests."""
    with flight.xplane.receiver() as receiver:
        for request in requests:
            receiver.send(request)
        packets = [
            protocol.decode_rref_response(packet)
            for _, packet in receiver.datagrams(time.monotonic() + _WATCH_S)
            if packet[:4] == b"RREF"
        ]
        for request in requests:
            receiver.send(protocol.RrefRequest(0, request.index, request.path))
    time.sleep(_APART_S)
    return packets


def _elements(count: int, rate_hz: int) -> List[protocol.RrefRequest]:
    """Requests for so many elements of an array that every version has."""
    return [
        protocol.RrefRequest(rate_hz, index, f"{doctor_names.DATA_ROWS}[{index % protocol.ROW_COUNT}]")
        for index in range(count)
    ]


def _unknown_omitted(flight: Flight) -> Answer:
    requests = [protocol.RrefRequest(50, 0, doctor_names.VERSION), protocol.RrefRequest(50, 1, _UNKNOWN)]
    pairs = [pair for packet in _answers(flight, requests) for pair in packet]
    known = sum(index == 0 for index, _ in pairs)
    unknown = [value for index, value in pairs if index == 1]
    text = f"{known} values of a known name, {len(unknown)} of an unknown one" + (
        f": {unknown[0]:g}" if unknown else ""
    )
    return judged(known > 0 and not unknown, text, known=known, unknown=len(unknown))


def _requests_a_frame(flight: Flight) -> Answer:
    answered = {index for packet in _answers(flight, _elements(_MOST, 20)) for index, _ in packet}
    text = f"{len(answered)} of {_MOST} requests sent at once are answered; the nodes send {_BATCH}"
    return judged(len(answered) >= _BATCH, text, sent=_MOST, answered=len(answered))


def _samples_whole(flight: Flight) -> Answer:
    packets = _answers(flight, _elements(_BATCH, FAST_HZ))
    sizes: Dict[int, int] = {}
    for packet in packets[len(packets) // 3 :]:  # first some are not asked for yet
        sizes[len(packet)] = sizes.get(len(packet), 0) + 1
    usual = max(sizes, key=lambda size: sizes[size]) if sizes else 0
    text = f"{_BATCH} values of a frame come in datagrams of {', '.join(map(str, sorted(sizes)))} values"
    return judged(usual == _BATCH, text, sizes={str(size): count for size, count in sizes.items()})


def _rate(flight: Flight) -> Answer:
    paths = (names.RUNNING_TIME, names.FRAME_PERIOD)
    requests = [protocol.RrefRequest(_EVERY_FRAME, index, path) for index, path in enumerate(paths)]
    samples = [dict(packet) for packet in _answers(flight, requests)]
    # Frames are as long as the computer's load makes them: each step of time is held against its own frame's period.
    pairs = [(sample[0], sample[1]) for sample in samples if len(sample) == len(paths)]
    frames = sum(max(1.0, (now - before) / max(period, 1e-3)) for (before, _), (now, period) in zip(pairs, pairs[1:]))
    text = f"values of {len(pairs)} frames came while {frames + 1:.0f} were flown, asked for {_EVERY_FRAME} a second"
    return judged(len(pairs) > 1 and len(pairs) > _SHARE * frames, text, values=len(pairs), frames=frames)


def _same_index(flight: Flight) -> Answer:
    first = protocol.RrefRequest(50, 0, names.EARTH_RADIUS)
    second = protocol.RrefRequest(50, 0, doctor_names.VERSION)
    packets = _answers(flight, [first, second])
    last = packets[-1][-1][1] if packets else float("nan")
    text = f"after a second request with the same index {last:.0f} comes; X-Plane's version is {flight.xplane.version}"
    return judged(abs(last - flight.xplane.version) < 1.0, text, value=last)


QUESTIONS = (
    Question("unknown-omitted", "a name that X-Plane does not know is not answered", _unknown_omitted, flies=False),
    Question("requests-a-frame", "100 requests sent at once are all taken", _requests_a_frame, flies=False),
    Question("samples-whole", "values of one frame come in one datagram", _samples_whole, flies=False),
    Question("rate-above-99", "a rate above every frame rate means every frame", _rate, flies=False),
    Question("same-index", "a request with an index in use replaces the one before", _same_index, flies=False),
)
