"""What xplane_eye costs and how old its pictures are: emulator's window, the eye, and a receiver played here."""

from __future__ import annotations

import os
import select
import socket
import struct
import time
from pathlib import Path
from typing import Dict, List, NamedTuple, Tuple

import numpy as np
from measuring import Use
from registry import Context, Measure, benchmark

from xplane_bridge.eye import wire
from xplane_bridge.harness import EmulatorProcess, HarnessError, ManagedProcess
from xplane_bridge.harness.display import VirtualDisplay
from xplane_bridge.resources import program

_PREFIX = struct.Struct("<4sHHII")
_PICTURE = 2
#: Width, height [px] and frames a second, and what was measured before it was built [ms]: CPU a picture, and from a
#: change to its picture's sending, median.
_SIZES: Tuple[Tuple[int, int, float, float, float], ...] = (
    (640, 480, 30.0, 3.5, 3.8),
    (640, 480, 60.0, 2.8, 3.8),
    (1280, 720, 30.0, 6.3, np.nan),
    (1920, 1080, 20.0, 12.5, 17.0),
)
_WARM_UP_S = 60.0
#: A reader that takes so long for each picture [s].
_SLOW_S = 0.05


class _Came(NamedTuple):
    """Pictures of one run; times by the clock of both processes [ns]."""

    change: np.ndarray
    sent: np.ndarray
    taken: np.ndarray
    bytes: np.ndarray  #: of JPEG
    cpu_ms: float  #: of the eye, a picture
    seconds: float


class _Receiver:
    """capture_node's part of the connection."""

    def __init__(self) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self._connection = socket.socket()
        self.port = self._server.getsockname()[1]

    def accept(self) -> None:
        """Lets the eye in."""
        self._server.settimeout(_WARM_UP_S)
        self._connection, _ = self._server.accept()
        self._connection.settimeout(_WARM_UP_S)
        self._reply(wire.WELCOME, 0)

    def picture(self) -> Tuple[int, int, int, int]:
        """The next picture: index, its change, its sending, bytes of its JPEG."""
        while True:
            _, _, header_bytes, body_bytes, _ = _PREFIX.unpack(self._exactly(_PREFIX.size))
            header, _ = self._exactly(header_bytes), self._exactly(body_bytes)
            if header[0] == _PICTURE:
                index, change, _, sent = struct.unpack_from("<Qqqq", header, 16)
                return index, change, sent, body_bytes

    def take(self, index: int) -> None:
        """Says that a picture was taken over."""
        self._reply(wire.TAKEN, index)

    def _exactly(self, count: int) -> bytes:
        data = bytearray()
        while len(data) < count:
            select.select([self._connection], [], [], _WARM_UP_S)
            piece = self._connection.recv(count - len(data))
            if not piece:
                raise HarnessError("xplane_eye has closed the connection")
            data += piece
        return bytes(data)

    def _reply(self, code: int, number: int) -> None:
        self._connection.sendall(struct.pack("<4sHHQ", b"XEYA", wire.VERSION, code, number))

    def close(self) -> None:
        """Ends it."""
        self._connection.close()
        self._server.close()


def _run(folder: Path, size: Tuple[int, int], fps: float, seconds: float, slow_s: float = 0.0) -> _Came:
    """Shows the emulator's window and reads what the eye sends of it."""
    receiver = _Receiver()
    with VirtualDisplay(folder, *size) as display:
        os.environ["DISPLAY"] = display.display
        window = ["--window", f"{size[0]}x{size[1]}", "--fps", f"{fps:g}", "--start", "air"]
        with EmulatorProcess(folder, window) as emulator:
            where = [f"127.0.0.1:{receiver.port}", "--xplane", f"127.0.0.1:{emulator.port}", "--local-port", "0"]
            command = [program("xplane_eye"), *where, "--no-calibrate", "--undo-file", folder / "undo.json"]
            with ManagedProcess("xplane_eye", [str(word) for word in command], folder) as eye:
                try:
                    receiver.accept()
                    receiver.take(receiver.picture()[0])
                    rows: List[Tuple[int, int, int, int]] = []
                    use, began = Use(eye.pid), time.monotonic()
                    while time.monotonic() < began + seconds:
                        index, change, sent, size_bytes = receiver.picture()
                        rows.append((change, sent, time.perf_counter_ns(), size_bytes))
                        time.sleep(slow_s)
                        receiver.take(index)
                    elapsed = time.monotonic() - began
                    cpu_ms = 1e3 * use.cpu_s() / len(rows)
                finally:
                    receiver.close()
    change, sent, taken, sizes = np.array(rows).T
    return _Came(change, sent, taken, sizes, cpu_ms, elapsed)


@benchmark
def eye(context: Context) -> List[Measure]:
    """CPU of xplane_eye a picture and the age of what it sends, at four sizes; and behind a slow receiver."""
    result: List[Measure] = []
    budgets: Dict[str, float] = {"640x480 at 60/s": 20.0}  # of a core; 1920x1080 at 30/s: what the emulator cannot draw
    for width, height, fps, cpu_before, sent_before in _SIZES:
        name = f"{width}x{height} at {fps:g}/s"
        folder = context.folder / name.replace(" ", "_").replace("/", "_")
        folder.mkdir(parents=True)
        came = _run(folder, (width, height), fps, context.seconds)
        to_sent, age = 1e-6 * (came.sent - came.change), 1e-6 * (came.taken - came.change)
        share = 0.1 * came.cpu_ms * len(came.sent) / came.seconds
        result += [
            Measure(f"{name}: pictures", len(came.sent) / came.seconds, "/s"),
            Measure(f"{name}: CPU a picture", came.cpu_ms, "ms"),
            Measure(f"{name}: CPU a picture, as first measured", cpu_before, "ms"),
            Measure(f"{name}: CPU", share, "% of a core", budgets.get(name)),
            Measure(f"{name}: change to sent, p50", float(np.percentile(to_sent, 50)), "ms"),
            *([] if np.isnan(sent_before) else [Measure(f"{name}: the same, as first measured", sent_before, "ms")]),
            Measure(f"{name}: change to sent, p95", float(np.percentile(to_sent, 95)), "ms"),
            Measure(f"{name}: change to receiver, p50", float(np.percentile(age, 50)), "ms"),
            Measure(f"{name}: change to receiver, p95", float(np.percentile(age, 95)), "ms", 25.0),
            Measure(f"{name}: JPEG, mean", float(came.bytes.mean()) / 1024.0, "KiB"),
        ]
    folder = context.folder / "slow"
    folder.mkdir(parents=True)
    slow = _run(folder, (640, 480), 60.0, context.seconds, _SLOW_S)
    age = 1e-6 * (slow.taken - slow.change) + 1e3 * _SLOW_S
    return [
        *result,
        Measure("640x480 at 60/s, 50 ms a picture to read: age when read, p50", float(np.percentile(age, 50)), "ms"),
        Measure("the same, as first measured", 119.0, "ms"),
        Measure("the same, by plain TCP as first measured", 1006.0, "ms"),
    ]
