"""A recording of any length with all topics and pictures, and the memory that what reads it takes.

It is made of the recorded bag's messages at the bridge's rates.
"""

from __future__ import annotations

import struct
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.bags import Bags
from xplane_bridge.export.formats import FORMATS

if TYPE_CHECKING:
    from xplane_bridge.bags import Recorded

RECORDED = Path(__file__).parents[2] / "data" / "bags" / "every_topic_0.1.0.bag"

#: Messages a second at 60 frames/s, as the bridge publishes them by default.
RATES = {
    "/tf": 60.0,
    "/xplane/flight_state": 60.0,
    "/xplane/odom": 60.0,
    "/xplane/imu/data": 60.0,
    "/xplane/global_position/global": 60.0,
    "/xplane/camera/camera_info": 30.0,
    "/xplane/camera/frame_state": 30.0,
    "/xplane/camera/image_raw/compressed": 30.0,
    "/xplane/control/applied": 60.0,
    "/xplane/control/manual": 50.0,
    "/xplane/joy": 50.0,
    "/xplane/mission/controls": 20.0,
    "/xplane/mission/surfaces": 20.0,
    "/xplane/mission/engines": 10.0,
    "/xplane/wind": 10.0,
    "/xplane/mission/autopilot": 5.0,
    "/xplane/mission/sim": 5.0,
    "/xplane/mission/warnings": 5.0,
    "/xplane/mission/electrical": 2.0,
    "/xplane/mission/fuel": 1.0,
    "/xplane/link_state": 1.0,
    "/diagnostics": 5.0,
}
#: What reads a recording, by name: programs of Python whose arguments are the bag and a folder to write to.
READERS = {
    "read": """
import sys
from xplane_bridge.bags import Bags
with Bags(sys.argv[1]) as bags:
    for topic in bags.topics:  # one after the other; pictures one at a time, as they are meant to be
        if "image_raw" in topic:
            assert all(message.format for _, message in bags.messages(topic))
        else:
            assert len(bags.read(topic).columns)
""",
    "report": """
import sys
from xplane_bridge.cli.flight_report import main
main([sys.argv[1], "-o", sys.argv[2] + "/report.html", "--png", sys.argv[2]]) and sys.exit(1)
""",
    "compare": """
import sys
from xplane_bridge.cli.flights.compare_flights import main
main([sys.argv[1], sys.argv[1], "-o", sys.argv[2] + "/comparison.html"]) and sys.exit(1)
""",
}
_EXPORT = """
import sys
from xplane_bridge.cli.bag_export import main
main([sys.argv[1], "-o", sys.argv[2], "--jobs", "1", "--format", *"FORMAT".split()]) and sys.exit(1)
"""
READERS.update({name: _EXPORT.replace("FORMAT", name) for name in ("csv --rate 100", *FORMATS)})
# Of the process itself: what wait4() shows of a child begins with the size of its parent.
_PEAK = """
print("PEAK", next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""

_STATE, _PICTURE = "/xplane/flight_state", "/xplane/camera/image_raw/compressed"
_PICTURES = 30  #: different ones
_STAMP = struct.Struct("<II")
_BEFORE_STAMP = 4  #: [bytes] header.seq


def peak_mb(name: str, bag: Path, folder: Path) -> float:
    """Runs one of `READERS`; the largest memory [MB] that it had at once."""
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-c", READERS[name] + _PEAK, str(bag), str(folder)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    return int(done.stdout.split("PEAK")[-1]) / 1024


def write_long_recording(path: Path, seconds: float) -> int:
    """Writes it. Returns the bytes of all pictures."""
    jpegs = _jpegs()
    bytes_of_pictures = 0
    with Bags(RECORDED) as bags, FlightBag(path) as states:
        messages: dict[str, list[bytes]] = {}
        topics: dict[str, Recorded] = {}
        for of_topic, _, raw in bags.recorded(list(RATES)):
            topics[of_topic.topic] = of_topic
            messages.setdefault(of_topic.topic, []).append(raw)
        name = "xplane_bridge/msg/FlightState"
        state = states.definitions.message(name, states.state(0.0, 0))
        for tick in range(round(seconds * 60.0)):
            t = tick / 60.0
            time_ns = stamp_ns(t)
            for topic, rate in RATES.items():
                number = int(t * rate + 1e-6)
                if tick and int((t - 1 / 60.0) * rate + 1e-6) == number:
                    continue
                if topic == _STATE:
                    state.header.seq, state.frame_count = number, number
                    state.header.stamp.sec, state.header.stamp.nanosec = divmod(time_ns, 1_000_000_000)
                    state.sim_time, state.sim_time_unwrapped, state.roll_deg = t, t, float(number % 90)
                    raw = bytes(states.definitions.store.serialize_ros1(state, name))
                    states.add_raw(topic, "xplane_bridge/FlightState", time_ns, raw)
                    continue
                raw = messages[topic][number % len(messages[topic])]
                if topic == _PICTURE:
                    raw = _with_picture(raw, jpegs[number % _PICTURES])
                    bytes_of_pictures += len(raw)
                states.add_recorded(topics[topic], time_ns, _stamped(topics[topic], time_ns, raw))
    return bytes_of_pictures


def _stamped(topic: Recorded, time_ns: int, raw: bytes) -> bytes:
    fields = (line.split("#")[0].split() for line in topic.definition.splitlines() if "=" not in line.split("#")[0])
    if next((words[0] for words in fields if words), "") not in ("Header", "std_msgs/Header"):
        return raw
    return raw[:_BEFORE_STAMP] + _STAMP.pack(*divmod(time_ns, 1_000_000_000)) + raw[_BEFORE_STAMP + _STAMP.size :]


def _jpegs() -> list[bytes]:
    """Pictures of 640x480 with as much detail as a landscape, about 50 kB each."""
    random = np.random.default_rng(4)
    out = []
    for _ in range(_PICTURES):
        coarse = cv2.resize(random.integers(0, 255, (60, 80, 3), dtype=np.uint8), (640, 480))
        out.append(cv2.imencode(".jpg", coarse, [cv2.IMWRITE_JPEG_QUALITY, 70])[1].tobytes())
    return out


def _with_picture(raw: bytes, jpeg: bytes) -> bytes:
    """A serialised CompressedImage with another picture: header, format, data."""
    at = 12
    for _ in range(2):  # frame_id, format
        at += 4 + struct.unpack_from("<I", raw, at)[0]
    return raw[:at] + struct.pack("<I", len(jpeg)) + jpeg
