"""A bag of an approach as the emulator draws it, made in a second, without ROS: pictures and what is known of each."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Callable, Mapping, NamedTuple, Sequence

import cv2
import numpy as np

from support.flights.synthetic_flight import FlightBag, stamp_ns
from support.white_lines import STANDING_M
from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.view.renderer.painter import Painter
from xplane_bridge.emulator.view.renderer.scene import Pose, Scene

if TYPE_CHECKING:
    from pathlib import Path

#: The emulator's aerodrome in config/aerodromes/apt.dat.
ANCHOR, HEADING_DEG = (37.4602, 126.4407), 152.0
SIZE = (640, 480)
FOV_DEG = 60.0
LEVER = (1.2, -0.3, -0.6)  #: [m] of the camera: forward, right, down
SPEED = 55.0  #: [m/s]
#: [s] of a frame
PERIOD = 1.0 / 30.0
SUN = (31.101993, 41.576129)  #: elevation, heading [deg]
RADIUS_M = 6378145.0
#: States of other aircraft a second; their times are those of no picture.
TRAFFIC_HZ = 4.0


class View(NamedTuple):
    """A camera of the aircraft."""

    topics: str = "/xplane/camera"
    size: tuple[int, int] = SIZE
    fov_deg: float = FOV_DEG
    pitch_deg: float = 0.0
    rotation: tuple[float, float, float, float] = (-0.5, 0.5, -0.5, 0.5)  #: of body_to_camera

    @property
    def matrix(self) -> list[float]:
        """CameraInfo's K."""
        focal = 0.5 * self.size[0] / math.tan(math.radians(0.5 * self.fov_deg))
        return [focal, 0.0, 0.5 * (self.size[0] - 1), 0.0, focal, 0.5 * (self.size[1] - 1), 0.0, 0.0, 1.0]


FORWARD = View()
_HALF = math.radians(-12.5)
#: As `camera.launch camera:=belly pitch:=-25 field_of_view:=80` publishes it. Forward, turned about the camera's right
#: by -25 degrees: the product of the two quaternions, by hand.
BELLY = View(
    "/xplane/belly/camera",
    (640, 360),
    80.0,
    -25.0,
    (
        0.5 * (math.sin(_HALF) - math.cos(_HALF)),
        0.5 * (math.cos(_HALF) - math.sin(_HALF)),
        -0.5 * (math.cos(_HALF) + math.sin(_HALF)),
        0.5 * (math.cos(_HALF) + math.sin(_HALF)),
    ),
)


def scene(t: float, far: float = 900.0) -> Scene:
    """The picture at `t` [s] of an approach in gusts that begins `far` [m] before the threshold, 3 degrees down."""
    along = -900.0 - far + SPEED * t
    across = 12.0 * math.sin(0.5 * t)
    latitude, longitude = geodetic(along, across)
    return Scene(
        frame=round(t / PERIOD),
        sim_time=t,
        latitude_deg=latitude,
        longitude_deg=longitude,
        altitude_m=max((-600.0 - along) * math.tan(math.radians(3.0)), 8.0),
        roll_deg=8.0 * math.sin(2.0 * t),
        pitch_deg=-2.0 + 1.5 * math.sin(4.0 * t),
        heading_deg=HEADING_DEG + 2.0 + 1.5 * math.cos(3.0 * t),
        eye_forward_m=LEVER[0],
        eye_right_m=LEVER[1],
        eye_down_m=LEVER[2],
        field_of_view_deg=FOV_DEG,
    )


def frame_state(bag: FlightBag, shown: Scene, ns: int, **changes: Any) -> dict[str, Any]:
    """FrameState of a picture, with the state of a scene: of the one shown, or of another."""
    body = earth.body_to_level(shown.roll_deg, shown.pitch_deg, shown.heading_deg)
    w, x, y, z = earth.quaternion(body)
    state = bag.state(shown.sim_time, shown.frame)
    state.update(
        latitude=shown.latitude_deg,
        longitude=shown.longitude_deg,
        altitude_msl=shown.altitude_m,
        altitude_agl=np.float32(shown.altitude_m - shown.terrain_m - STANDING_M),  # from about the wheels
        orientation={"x": x, "y": y, "z": z, "w": w},
        angular_velocity={"x": 0.0, "y": 0.1, "z": 0.0},
        velocity_ned={"x": SPEED, "y": 0.0, "z": 3.0},
    )
    forward, right, down = LEVER
    return {
        "header": bag.header(ns, "camera_optical"),
        "state": state,
        "frame_sim_time": shown.sim_time,
        "frame_period": np.float32(PERIOD),
        "display_delay": 0.058,
        "camera_pose_source": 2,
        "camera_pose_uncertainty_deg": np.float32(0.002),
        "camera_pose_uncertainty": np.float32(0.004),
        "body_to_camera": {
            "translation": {"x": forward, "y": -right, "z": -down},
            "rotation": {"x": -0.5, "y": 0.5, "z": -0.5, "w": 0.5},
        },
        **changes,
    }


def seen(shown: Scene, view: View) -> Scene:
    """A scene as a camera has it."""
    return replace(shown, head_pitch_deg=view.pitch_deg, field_of_view_deg=view.fov_deg)


def add_picture(bag: FlightBag, view: View, pixels: np.ndarray, frame: Mapping[str, Any]) -> None:
    """Write a picture of a camera, its CameraInfo and its FrameState."""
    header = frame["header"]
    ns = header["stamp"]["sec"] * 1_000_000_000 + header["stamp"]["nanosec"]
    pose = {**frame["body_to_camera"], "rotation": dict(zip("xyzw", view.rotation))}
    bag.add(f"{view.topics}/frame_state", "xplane_bridge/FrameState", ns, {**frame, "body_to_camera": pose})
    info = {"header": header, "width": view.size[0], "height": view.size[1], "K": view.matrix}
    bag.add(f"{view.topics}/camera_info", "sensor_msgs/CameraInfo", ns, info)
    jpeg = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, 90])[1]
    picture = {"header": header, "format": "bgr8; jpeg compressed bgr8", "data": jpeg.reshape(-1)}
    bag.add(f"{view.topics}/image_raw/compressed", "sensor_msgs/CompressedImage", ns, picture)


def geodetic(along: float, across: float) -> tuple[float, float]:
    """Latitude, longitude [deg] so far along the runway's heading from its middle, and right of that [m]."""
    turn = math.radians(HEADING_DEG)
    north = along * math.cos(turn) - across * math.sin(turn)
    east = along * math.sin(turn) + across * math.cos(turn)
    cosine = math.cos(math.radians(ANCHOR[0]))
    return ANCHOR[0] + math.degrees(north / RADIUS_M), ANCHOR[1] + math.degrees(east / (RADIUS_M * cosine))


def traffic_state(bag: FlightBag, t: float, poses: Sequence[Pose]) -> dict[str, Any]:
    """TrafficState of aircraft 1, 2, ... at `t` [s]; nan: that one is not there."""
    there = [k for k, pose in enumerate(poses) if not math.isnan(pose[0])]
    names = ("latitude", "longitude", "altitude_msl", "roll_deg", "pitch_deg", "heading_true_deg")
    return {
        "header": bag.header(stamp_ns(t), ""),
        "sim_time": np.float32(t),
        "epoch": 1,
        "number": [k + 1 for k in there],
        **{name: [poses[k][axis] for k in there] for axis, name in enumerate(names)},
    }


def write_approach(
    path: Path,
    frames: int,
    late: int = 0,
    far: float = 900.0,
    every: int = 15,
    traffic: Callable[[float], Sequence[Pose]] = lambda _: (),
    views: Sequence[View] = (FORWARD,),
    **turned: float,
) -> Path:
    """Write a bag of pictures.

    Args:
        path: Of the bag.
        frames: So many pictures.
        late: Their states are of frames so many later.
        far: [m] before the threshold where it begins.
        every: Frames of 1/30 s from one picture to the next.
        traffic: Where other aircraft are at a time [s]; recorded between the pictures.
        views: The cameras; pictures of one frame have the same stamp.
        **turned: Of every scene, in place of the approach's.
    """
    painters = [Painter(*view.size, ANCHOR, HEADING_DEG) for view in views]
    with FlightBag(path) as bag:
        for k in range(0, frames * every, every):
            t = k * PERIOD
            ns = stamp_ns(t)
            shown, known = (
                replace(scene(at, far), others=tuple(traffic(at)), **turned) for at in (t, t + late * PERIOD)
            )
            frame = frame_state(bag, known, ns)
            for view, painter in zip(views, painters):
                add_picture(bag, view, painter.paint(seen(shown, view)), frame)
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", ns, frame["state"])
            if k % (30 * every) == 0:
                names = [f"sim/graphics/scenery/sun_{name}_degrees" for name in ("pitch", "heading")]
                names += [f"sim/flightmodel/position/{name}_ref" for name in ("lat", "lon")]
                values = {"header": bag.header(ns, ""), "names": names, "values": [*SUN, *ANCHOR]}
                bag.add("/xplane/datarefs", "xplane_bridge/DatarefValues", ns, values)
        for k in range(-10, math.ceil(frames * every * PERIOD * TRAFFIC_HZ) + 10):
            t = (k + 0.3) / TRAFFIC_HZ
            if traffic(t):
                state = traffic_state(bag, t, traffic(t))
                bag.add("/xplane/traffic/state", "xplane_bridge/TrafficState", stamp_ns(t), state)
    return path
