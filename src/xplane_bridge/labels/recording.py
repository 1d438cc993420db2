"""Which recording a file of labels is of. Stamps do not say it: in lock-step they are the same in every flight."""

from __future__ import annotations

import hashlib
import logging
from typing import TYPE_CHECKING, Dict

from xplane_bridge.bags.cameras import cameras
from xplane_bridge.labels import table
from xplane_bridge.labels.table import Key, LabelError, Labels

if TYPE_CHECKING:
    from pathlib import Path

    from xplane_bridge.bags import Bags

_LOG = logging.getLogger(__name__)
#: What labels are made of: poses, optics, other aircraft, sun.
_MADE_OF = (
    "xplane_bridge/FrameState",
    "sensor_msgs/CameraInfo",
    "xplane_bridge/TrafficState",
    "xplane_bridge/DatarefValues",
)


def identity(bags: Bags) -> str:
    """Give what is the same for two recordings only where all messages that labels are made of are the same.

    It is the sum of their SHA-256: the order in which they are read, and how bags are split, do not matter.

    Raises:
        BagError: The bags cannot be read.
    """
    topics = [info.topic for info in bags.topics.values() if info.count and info.msgtype in _MADE_OF]
    messages = bags.recorded(topics) if topics else ()
    total = sum(int.from_bytes(hashlib.sha256(raw).digest(), "big") for _, _, raw in messages)
    return f"{total % (1 << 256):064x}"


def labels_of(bags: Bags, path: Path) -> Labels:
    """Read the labels of a recording's pictures; their first line has its identity, also where the file has none.

    Args:
        bags: Open.
        path: A file of `label_images`.

    Raises:
        LabelError: It cannot be used, or is of another recording.
        BagError: The bags cannot be read.
    """
    labels = table.read(path)
    names = ", ".join(map(str, bags.paths))
    recording = identity(bags)
    known = labels.about.get("recording")
    if known is None:
        why = _contradiction(bags, labels)
    else:
        why = "" if known == recording else "what they were made from (FrameState and the like) differs"
    if why:
        made_of = ", ".join(labels.about["bags"])
        msg = (
            f"{path}: labels of another recording, made from {made_of}; expected those of {names}, but {why}; "
            "label_images writes them anew"
        )
        raise LabelError(msg)
    if known is None:
        _LOG.warning(
            "%s: written by a version that did not note the recording; taken for labels of %s, whose pictures have the "
            "same stamps. In lock-step other flights have them, too: label_images writes the file anew",
            path,
            names,
        )
    return Labels({**labels.about, "recording": recording}, labels.frames)


def _contradiction(bags: Bags, labels: Labels) -> str:
    """Give why labels without an identity cannot be of a recording; empty where they may be."""
    recorded: Dict[Key, int] = {}
    for camera in cameras(bags):
        frames = bags.read(camera.frames, ["header.stamp", "quality"])
        for stamp, quality in zip(frames.stamp.tolist(), frames["quality"].tolist()):
            recorded[camera.name, stamp] = quality
    for key, frame in labels.frames.items():
        picture = f"picture of camera {key[0]} with stamp {key[1]} ns"
        if key not in recorded:
            return f"these have no {picture}"
        quality = frame.get("quality", recorded[key])  # the first versions did not write it
        if quality != recorded[key]:
            return f"the {picture} has quality {recorded[key]} in these, and {quality} there"
    return ""
