"""The cameras of a recording: the topics of each capture_node, by the camera's name."""

from __future__ import annotations

from typing import Mapping, NamedTuple, Sequence

from xplane_bridge.bags import FLIGHT_STATE, BagError, Bags

COMPRESSED = "sensor_msgs/CompressedImage"
RAW = "sensor_msgs/Image"
#: Name of the bridge's own camera, whose topics have no further name space.
FIRST = "camera"
_FRAMES = "xplane_bridge/FrameState"


class Camera(NamedTuple):
    """One camera's topics, by full name."""

    #: As `camera.launch` gave it: the name space below the bridge's; `FIRST` of the bridge's own. The whole name space,
    #: of each camera, where two would be called alike; the whole topic where that takes none apart either.
    name: str
    frames: str  #: FrameState of each picture, at least one message
    info: str  #: CameraInfo, recorded or not
    images: str  #: compressed pictures, else raw ones; empty where none were recorded


def cameras(bags: Bags) -> list[Camera]:
    """Give the cameras with at least one FrameState, the bridge's own first, the others by name.

    Of several bridges in a recording, those of the first.
    """
    topics = bags.topics
    filled = [name for name, info in sorted(topics.items()) if info.count and info.msgtype == _FRAMES]
    space = bags.name_space
    beside_state = bags.topic_of_type(FLIGHT_STATE) is not None
    places = {name: _place(name) for name in (bags.own(filled) if beside_state else filled)}
    short = {
        name: place[len(space.strip("/")) :] if beside_state else place.partition("/")[2]
        for name, place in places.items()
    }
    names = _names(short, places)
    found = []
    for name in places:
        folder = name.rsplit("/", 1)[0]
        images = [
            topic
            for kind in (COMPRESSED, RAW)
            for topic, info in sorted(topics.items(), key=lambda item: (not item[0].startswith(f"{folder}/"), item[0]))
            # Pictures of an only camera may have any name; those of several have places of their own.
            if info.count and info.msgtype == kind and (len(filled) == 1 or topic.startswith(f"{folder}/"))
        ]
        found.append(Camera(names[name], name, f"{folder}/camera_info", images[0] if images else ""))
    return sorted(found, key=lambda camera: (short[camera.frames] != "", camera.name))


def chosen_cameras(bags: Bags, names: Sequence[str] = ()) -> list[Camera]:
    """Give the cameras of these names, all when empty.

    Raises:
        BagError: The bags have no camera, or none of a name; the text says which there are.
    """
    found = cameras(bags)
    paths = ", ".join(map(str, bags.paths))
    if not found:
        msg = f"{paths}: no message of type {_FRAMES}; record camera/frame_state (launch/record.launch does)"
        raise BagError(msg)
    have = [camera.name for camera in found]
    missing = sorted(set(names) - set(have))
    if missing:
        msg = f"{paths}: no camera {', '.join(missing)}; expected some of: {', '.join(have)}"
        raise BagError(msg)
    return [camera for camera in found if not names or camera.name in names]


def has_jpegs(bags: Bags, camera: Camera) -> bool:
    """Returns whether a camera's pictures were recorded, and compressed."""
    return bool(camera.images) and bags.topics[camera.images].msgtype == COMPRESSED


def _names(short: Mapping[str, str], places: Mapping[str, str]) -> Mapping[str, str]:
    """Give the cameras' names, by topic: short ones, else whole places; files and labels take them apart by these."""
    # No topic has a hyphen: with it for the slash, a/b and a_b differ. Whole topics differ also where a camera in the
    # root name space, whose place is empty, is beside one in the name space `FIRST`.
    topics = {topic: topic for topic in places}
    for named, slash in ((short, "_"), (places, "_"), (places, "-"), (topics, "-")):
        names = {topic: place.strip("/").replace("/", slash) or FIRST for topic, place in named.items()}
        if len(set(names.values())) == len(names):
            break
    return names


def _place(topic: str) -> str:
    """The name space of a camera, without the first slash."""
    ending = "/camera/frame_state"
    return (topic[: -len(ending)] if topic.endswith(ending) else topic).strip("/")
