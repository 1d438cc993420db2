"""A recorded flight's pictures, labelled: poses and optics out of the bag, sun and ground beside them."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Any, Iterator, Mapping, NamedTuple, Optional, Sequence

import numpy as np

from xplane_bridge import __version__
from xplane_bridge.bags import FLIGHT_STATE, Bags, Table
from xplane_bridge.bags.cameras import Camera as Recorded
from xplane_bridge.bags.cameras import chosen_cameras
from xplane_bridge.constants import ImageQuality
from xplane_bridge.labels import table as label_table
from xplane_bridge.labels.apt import Airport
from xplane_bridge.labels.camera import Camera, Optics, Pose
from xplane_bridge.labels.heights import MEASURED_SIGMA_M, STANDING_M, STANDING_SIGMA_M, Ground, Profile, profile
from xplane_bridge.labels.recording import identity
from xplane_bridge.labels.table import LabelError
from xplane_bridge.labels.things import MAP_SIGMA_M, SPAN_M, Labeller, Sun
from xplane_bridge.labels.traffic import RecordedTraffic
from xplane_bridge.labels.world import Flat, Sphere, World

_DATAREFS = "xplane_bridge/DatarefValues"
#: Where the sun stands, and the origin whose axes that is in.
_SUN = ("sim/graphics/scenery/sun_pitch_degrees", "sim/graphics/scenery/sun_heading_degrees")
_ORIGIN = ("sim/flightmodel/position/lat_ref", "sim/flightmodel/position/lon_ref")
#: What a picture needs of its state: position and attitude.
_NEEDED = 2 | 16
_HAS_AGL = 2 | 4
_SHOWS = ("picture_x", "picture_y", "picture_width", "picture_height")
#: What of FrameState labelling goes by.
_COLUMNS = (
    *("header.stamp", "quality", "frame_period", "display_delay"),
    *("camera_pose_source", "body_to_camera", "camera_pose_uncertainty", "camera_pose_uncertainty_deg"),
    *_SHOWS,
    *("state.valid", "state.epoch", "state.sim_time", "state.latitude", "state.longitude", "state.altitude_msl"),
    *("state.orientation", "state.angular_velocity", "state.velocity_ned"),
)
#: Pictures that do not show what their state and CameraInfo say, or may not, and why.
_SHOWS_ELSE = {
    ImageQuality.FROZEN: "frozen: the same pixels while the aircraft moved",
    ImageQuality.BLACK: "black, or almost",
    ImageQuality.FOV_ASSUMED: "the field of view was assumed, or changed just there",
}
#: By these a picture may be of the neighbouring frame, or its state is not that of its very frame.
_UNSURE = (
    ImageQuality.INTERPOLATED
    | ImageQuality.OFF_FRAME
    | ImageQuality.DISPLAY_UNKNOWN
    | ImageQuality.CLOCK_UNSURE
    | ImageQuality.DELAY_ASSUMED
    | ImageQuality.BORDERLINE
    | ImageQuality.EPOCH_EDGE
)
_MEASURED = 2
#: What cannot be known of the motion is taken for lively, where it matters.
_TURN_RATE, _SPEED = 0.5, 100.0
#: Below about 20 frames a second X-Plane slows its time instead (docs/protocol.md).
_LONGEST_FRAME_S = 0.05


class Options(NamedTuple):
    """How to label; goes into the file."""

    flat_world: bool = False  #: the emulator's ground instead of the sphere
    map_sigma: float = MAP_SIGMA_M  #: [m]
    standing_height: Optional[float] = None  #: [m] altitude less y_agl of the parked aircraft; None: not known
    span: float = SPAN_M  #: [m] of other aircraft, whose size X-Plane does not show


class Frame(NamedTuple):
    """One picture that can be labelled."""

    name: str  #: of its camera
    stamp: int  #: [ns]
    camera: Camera
    epoch: int  #: of its state
    sim_time: float  #: [s] of its state
    quality: int  #: QUALITY_* of its FrameState


class _Seen:
    """What one camera's pictures are known by."""

    def __init__(self, bags: Bags, camera: Recorded) -> None:
        self.name = camera.name
        self.frames = bags.read(camera.frames, _COLUMNS)
        self.infos = _optics(bags, camera.info)
        self.suns = _suns(bags, self.frames.stamp)
        between = (self.frames["quality"] & int(ImageQuality.INTERPOLATED)) != 0
        self._off = np.where(between, _half_spacing(bags, self.frames), _late(bags, self.frames))

    def quality(self, row: int) -> int:
        """Give QUALITY_* of a picture."""
        return int(self.frames["quality"][row])

    def pose(self, row: int) -> Pose:
        """Give where a picture's camera was."""
        return _pose(self.frames, row, float(self._off[row]))

    def optics(self, row: int) -> Optics:
        """Give what a picture's camera shows."""
        x, y, width, height = (int(self.frames[name][row]) for name in _SHOWS)
        return self.infos[int(self.frames.stamp[row])]._replace(shows=(x, y, width, height))

    def why_not(self, row: int) -> str:
        """Give why a picture cannot be labelled; empty where it can."""
        quality = self.quality(row)
        if quality & ImageQuality.STATE_MISSING:
            return "no state, or its position or attitude is not known"
        if int(self.frames["state.valid"][row]) & _NEEDED != _NEEDED:
            return "no state, or its position or attitude is not known"
        for bit, why in _SHOWS_ELSE.items():
            if quality & bit:
                return why
        if int(self.frames["camera_pose_source"][row]) != _MEASURED:
            return "the camera's pose was not measured"
        if int(self.frames.stamp[row]) not in self.infos:
            return "no camera_info of the same stamp"
        return ""


class Flight:
    """What labelling needs of a flight.

    Args:
        bags: Open.
        airport: What to label.
        heights: Of runway ends [m MSL], from a user.
        options: How.
        cameras: Names of those to label; all when empty.

    Raises:
        LabelError: What is known of a camera was not recorded.
        BagError: The bags have no such camera, or cannot be read.
    """

    def __init__(
        self,
        bags: Bags,
        airport: Airport,
        heights: Mapping[str, float],
        options: Options,
        cameras: Sequence[str] = (),
    ) -> None:
        self.left_out: Counter[str] = Counter()  #: pictures without labels, by reason
        self.labelled: Counter[str] = Counter()  #: pictures with labels, by camera
        self._bags, self.airport, self._options = bags, airport, options
        self._seen = [_Seen(bags, camera) for camera in chosen_cameras(bags, cameras)]
        middle = airport.runways[0].ends
        self._world: World = (
            Flat(*(0.5 * (getattr(middle[0], name) + getattr(middle[1], name)) for name in ("latitude", "longitude")))
            if options.flat_world
            else Sphere()
        )
        ground = _ground(bags, options.standing_height)
        self.profiles: list[Profile] = [profile(airport, runway, ground, heights) for runway in airport.runways]
        self.labeller = Labeller(airport, self.profiles, self._world, options.map_sigma)
        self.traffic = RecordedTraffic(bags, options.span)
        self.others_unknown = 0  #: labelled pictures of which it is not known where other aircraft were

    def frames(self) -> Iterator[Frame]:
        """Give the pictures that can be labelled, by camera, in the order of the bag; the others are counted."""
        self.left_out.clear()
        for seen in self._seen:
            of = f" (camera {seen.name})" if len(self._seen) > 1 else ""
            for row, stamp in enumerate(seen.frames.stamp.tolist()):
                reason = seen.why_not(row)
                if reason:
                    self.left_out[reason + of] += 1
                else:
                    camera = Camera(self._world, seen.pose(row), seen.optics(row))
                    epoch, time = (seen.frames[f"state.{name}"][row] for name in ("epoch", "sim_time"))
                    yield Frame(seen.name, stamp, camera, int(epoch), float(time), seen.quality(row))

    def labels(self) -> Iterator[dict[str, Any]]:
        """Label all pictures: what each line of the file is."""
        self.others_unknown = 0
        self.labelled.clear()
        suns = {seen.name: seen.suns for seen in self._seen}
        for frame in self.frames():
            self.labelled[frame.name] += 1
            optics = frame.camera.optics
            others = self.traffic.at(frame.epoch, frame.sim_time)
            self.others_unknown += others is None
            yield {
                "camera": frame.name,
                "stamp_ns": frame.stamp,
                "width": optics.width,
                "height": optics.height,
                "picture": optics.shows,
                "quality": frame.quality,
                "others_known": others is not None,
                "objects": self.labeller.label(frame.camera, suns[frame.name].get(frame.stamp), others or ()),
            }

    def about(self) -> dict[str, Any]:
        """What the first line of the file says."""
        runways = [
            f"{r.ends[0].number}/{r.ends[1].number}: {p.source}" for r, p in zip(self.airport.runways, self.profiles)
        ]
        return {
            "xplane_bridge": __version__,
            "bags": [path.name for path in self._bags.paths],
            "cameras": [seen.name for seen in self._seen],
            "airport": self.airport.ident,
            "apt": {
                "file": Path(self.airport.file).name,
                "sha256": self.airport.sha256,
                "version": self.airport.version,
            },
            "heights": runways,
            "sun": any(seen.suns for seen in self._seen),
            "other_aircraft": self.traffic.recorded,
            "others_unknown": self.others_unknown,
            **self._options._asdict(),
        }


def label_flight(
    bags: Bags,
    path: Path,
    airport: Airport,
    heights: Mapping[str, float],
    options: Options,
    cameras: Sequence[str] = (),
) -> tuple[int, Flight]:
    """Label the pictures of a flight's cameras into a file; gives how many, and the flight with what was left out.

    Raises:
        LabelError: Nothing can be labelled, or the file cannot be written.
    """
    flight = Flight(bags, airport, heights, options, cameras)

    def about() -> dict[str, Any]:
        if not flight.labelled:
            reasons = ", ".join(f"{count}: {reason}" for reason, count in flight.left_out.items())
            remedy = "record with this version, from the whole of X-Plane's own window"
            msg = f"{bags.paths[0]}: no picture can be labelled ({reasons}); {remedy}"
            raise LabelError(msg)
        return {**flight.about(), "recording": identity(bags), "left_out": dict(sorted(flight.left_out.items()))}

    return label_table.write(path, about, flight.labels()), flight


def _optics(bags: Bags, topic: str) -> dict[int, Optics]:
    if topic not in bags.topics or not bags.topics[topic].count:
        names = ", ".join(map(str, bags.paths))
        msg = f"{names}: no {topic}; record it (launch/record.launch does), or choose other cameras with --camera"
        raise LabelError(msg)
    infos = bags.read(topic, ["header.stamp", "width", "height", "K"])
    out: dict[int, Optics] = {}
    alike: dict[Optics, Optics] = {}
    for stamp, width, height, k in zip(infos.stamp.tolist(), infos["width"], infos["height"], infos["K"]):
        if k[0] > 0.0 and k[4] > 0.0:
            optics = Optics(int(width), int(height), float(k[0]), float(k[4]), float(k[2]), float(k[5]))
            out[stamp] = alike.setdefault(optics, optics)
    return out


def _suns(bags: Bags, stamps: np.ndarray) -> dict[int, Sun]:
    """Where the sun stood, by stamp: from the datarefs that rx_node was asked to publish; empty when it was not."""
    topic = bags.topic_of_type(_DATAREFS)
    if topic is None or not bags.topics[topic].count:
        return {}
    rows = []
    values = bags.read(topic)
    for stamp, names, numbers in zip(values.stamp.tolist(), values["names"], values["values"]):
        of = dict(zip(names, numbers))
        rows.append((stamp, *(float(of.get(name, math.nan)) for name in (*_SUN, *_ORIGIN))))
    rows = sorted(row for row in rows if math.isfinite(row[1]) and math.isfinite(row[2]))
    if not rows:
        return {}
    at = np.array([row[0] for row in rows])
    newest = np.searchsorted(at, stamps, side="right") - 1
    suns = []
    for _, elevation, heading, latitude, longitude in rows:
        known = math.isfinite(latitude) and math.isfinite(longitude)
        suns.append(Sun(elevation, heading, (latitude, longitude) if known else None))
    # It hardly moves: the first one holds before, too.
    return {stamp: suns[max(k, 0)] for stamp, k in zip(stamps.tolist(), newest.tolist())}


def _late(bags: Bags, frames: Table) -> np.ndarray:
    """By how much the states of pictures of a pause are of later than these may show [s]; 0 of other pictures.

    Earlier versions gave what was shown within the display delay of a pause's beginning the state of the pause.
    """
    late = np.where(frames["quality"] & int(ImageQuality.PAUSED), _delay(frames), 0.0)
    topic = bags.topic_of_type(FLIGHT_STATE)
    if topic is None or not bags.topics[topic].count or not late.any():
        return late
    states = bags.read(topic, ["sim_time"])
    order = np.argsort(states.stamp, kind="stable")
    due = np.interp(_drawn(frames), states.stamp[order], states["sim_time"][order].astype(np.float64))
    bounded: np.ndarray = np.clip(frames["state.sim_time"] - due, 0.0, late)
    return bounded


def _half_spacing(bags: Bags, frames: Table) -> np.ndarray:
    """How far pictures' times are from the nearer of the received states around them, at most [s]; 0: not recorded."""
    topic = bags.topic_of_type(FLIGHT_STATE)
    if topic is None or bags.topics[topic].count < 2:
        return np.zeros(len(frames.stamp))
    states = bags.read(topic, ["sim_time"])
    order = np.argsort(states.stamp, kind="stable")
    after = np.clip(np.searchsorted(states.stamp[order], _drawn(frames)), 1, len(order) - 1)
    steps = np.diff(states["sim_time"][order].astype(np.float64))
    half: np.ndarray = 0.5 * np.maximum(steps[after - 1], 0.0)  # back: another flight
    return half


def _delay(frames: Table) -> np.ndarray:
    """From pictures' frames to their display [s]; 0 where it is not known."""
    delay: np.ndarray = np.nan_to_num(frames["display_delay"].astype(np.float64))
    return delay


def _drawn(frames: Table) -> np.ndarray:
    """When pictures' frames were drawn, by the clock of the states' stamps [ns]."""
    drawn: np.ndarray = frames.stamp - 1e9 * _delay(frames)
    return drawn


def _ground(bags: Bags, standing: Optional[float]) -> Optional[Ground]:
    topic = bags.topic_of_type(FLIGHT_STATE)
    if topic is None or not bags.topics[topic].count:
        return None
    states = bags.read(topic, ["valid", "latitude", "longitude", "altitude_msl", "altitude_agl"])
    good = (states["valid"].astype(np.int64) & _HAS_AGL) == _HAS_AGL
    height = (states["altitude_msl"] - states["altitude_agl"])[good] - (STANDING_M if standing is None else standing)
    sigma = MEASURED_SIGMA_M if standing is not None else math.hypot(MEASURED_SIGMA_M, STANDING_SIGMA_M)
    return Ground(states["latitude"][good], states["longitude"][good], height, sigma)


def _pose(frames: Table, row: int, off: float = 0.0) -> Pose:
    """Give a picture's pose; `off` [s]: by how much its state may be of another time than it shows."""

    def vector(path: str, axes: str = "xyz") -> np.ndarray:
        return np.array([float(frames[f"{path}.{axis}"][row]) for axis in axes])

    quality = int(frames["quality"][row])
    rates, velocity = vector("state.angular_velocity"), vector("state.velocity_ned")
    period = float(frames["frame_period"][row])
    period = period if period > 0.0 else _LONGEST_FRAME_S
    # A spread as wide as the bound, not an even one: cautious.
    angle, place = float(frames["camera_pose_uncertainty_deg"][row]), float(frames["camera_pose_uncertainty"][row])
    return Pose(
        float(frames["state.latitude"][row]),
        float(frames["state.longitude"][row]),
        float(frames["state.altitude_msl"][row]),
        vector("state.orientation", "xyzw"),
        vector("body_to_camera.translation"),
        vector("body_to_camera.rotation", "xyzw"),
        math.radians(angle) if math.isfinite(angle) else 0.0,
        place if math.isfinite(place) else 0.0,
        float(np.linalg.norm(rates)) if np.isfinite(rates).all() else _TURN_RATE,
        velocity if np.isfinite(velocity).all() else np.full(3, _SPEED / math.sqrt(3.0)),
        max(period, off),
        bool(quality & _UNSURE) or off > 0.5 * period,
    )
