"""Camera pictures of a bag, one at a time."""

from __future__ import annotations

from typing import Any, Iterator, Sequence

import cv2
import numpy as np

from xplane_bridge.bags import BagError, Bags, Table
from xplane_bridge.bags.cameras import COMPRESSED, RAW, Camera

#: A picture is received before or after its FrameState, at most so many pictures off.
_NEIGHBOURS = 8
_CHANNELS = {"bgr8": 3, "rgb8": 3, "bgra8": 4, "rgba8": 4, "mono8": 1}
_TO_GREY = {
    "bgr8": cv2.COLOR_BGR2GRAY,
    "rgb8": cv2.COLOR_RGB2GRAY,
    "bgra8": cv2.COLOR_BGRA2GRAY,
    "rgba8": cv2.COLOR_RGBA2GRAY,
}


def image_topic(bags: Bags, order: Sequence[str] = (RAW, COMPRESSED)) -> str:
    """The topic with camera pictures.

    Args:
        bags: Open bags.
        order: Message types, the preferred one first.

    Raises:
        BagError: There is none.
    """
    for msgtype in order:
        topic = bags.topic_of_type(msgtype)
        if topic is not None and bags.topics[topic].count:
            return topic
    names = ", ".join(str(path) for path in bags.paths)
    msg = f"{names}: no camera images; record camera/image_raw/compressed (launch/record.launch does)"
    raise BagError(msg)


def grey_pictures(bags: Bags, topic: str) -> Iterator[tuple[int, np.ndarray]]:
    """Yield stamp [ns] and grey picture of every image, in time order.

    Raises:
        BagError: An encoding other than bgr8, rgb8, bgra8, rgba8, mono8, or a JPEG that cannot be decoded.
    """
    compressed = bags.topics[topic].msgtype == COMPRESSED
    for _, message in bags.messages(topic):
        yield _stamp(message), (_decoded(message, topic) if compressed else _grey(message))


def pictures_near(bags: Bags, camera: Camera, frames: Table, rows: Sequence[int]) -> Iterator[tuple[int, np.ndarray]]:
    """Yield stamp [ns] and picture (blue, green, red) of some of a camera's frames.

    Of a frame whose picture was not recorded it is that of a neighbour; none comes twice, and one that cannot be
    decoded is left out. The pictures between are not read.

    Args:
        bags: Open.
        camera: One with compressed pictures (`has_jpegs`).
        frames: Its FrameStates.
        rows: Of those wanted.
    """
    received, stamps = bags.times(camera.images), frames.stamp
    seen = set()
    for row in rows:
        wanted = int(stamps[row])
        middle = int(np.searchsorted(received, frames.time[row]))
        near = received[max(middle - _NEIGHBOURS, 0) : middle + _NEIGHBOURS]
        span = (int(near[0]), int(near[-1]))
        candidates = (message for _, message in bags.messages(camera.images, [span]))
        message = min(candidates, key=lambda candidate: abs(_stamp(candidate) - wanted))
        stamp = _stamp(message)
        picture = cv2.imdecode(np.asarray(message.data), cv2.IMREAD_COLOR)
        if stamp not in seen and picture is not None:
            seen.add(stamp)
            yield stamp, picture


def _stamp(message: Any) -> int:
    return int(message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec)


def _decoded(message: Any, topic: str) -> np.ndarray:
    picture = cv2.imdecode(np.asarray(message.data), cv2.IMREAD_GRAYSCALE)
    if picture is None:
        msg = f"{topic}: a picture of format {message.format!r} cannot be decoded"
        raise BagError(msg)
    return picture


def _grey(message: Any) -> np.ndarray:
    channels = _CHANNELS.get(message.encoding)
    if channels is None:
        msg = f"image encoding {message.encoding!r} is not supported; expected {', '.join(_CHANNELS)}"
        raise BagError(msg)
    rows = np.asarray(message.data).reshape(message.height, message.step)[:, : message.width * channels]
    if channels == 1:
        return np.ascontiguousarray(rows)
    return cv2.cvtColor(rows.reshape(message.height, message.width, channels), _TO_GREY[message.encoding])
