"""The flight that the tests of exports write, and how they call the program."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np

from support.flights.synthetic_flight import FlightBag, stamp_ns
from xplane_bridge.cli import bag_export

if TYPE_CHECKING:
    from pathlib import Path

RATE = 50.0
FROZEN, INTERPOLATED, DELAY_ASSUMED = 32, 2, 8192


def picture(k: int) -> np.ndarray:
    image = np.zeros((24, 32, 3), np.uint8)
    image[:, :, 0] = 10 * k % 256
    image[:12, :, 2] = 200
    return image


def write_flight(path: Path, seconds: float = 4.0, offset: float = 0.0, raw_images: bool = False) -> Path:
    """States at 50 Hz with a gap of 1 s after 2 s, odometry, an image every 0.2 s, mode and failure labels.

    The camera looks ahead and is 0.1 m further ahead at each image. Image 3 is frozen, 4 interpolated with a delay
    that is assumed, 5 has no frame state, 6 no camera info.
    """
    with FlightBag(path) as bag:
        for k in range(round(seconds * RATE)):
            t = k / RATE + offset + (1.0 if k >= 2 * RATE else 0.0)
            state = bag.state(t, k)
            ns = stamp_ns(t)
            bag.add("/xplane/flight_state", "xplane_bridge/FlightState", ns, state)
            pose = {"position": {"x": t, "y": 2 * t, "z": 3 * t}, "orientation": {"z": math.sin(t), "w": math.cos(t)}}
            bag.add(
                "/xplane/odom",
                "nav_msgs/Odometry",
                ns,
                {"header": bag.header(ns, "map"), "pose": {"pose": pose}},
            )
            if k % 10 == 0:
                number = k // 10
                header = bag.header(ns, "camera_forward_optical", number)
                quality = FROZEN if number == 3 else INTERPOLATED | DELAY_ASSUMED if number == 4 else 0
                frame = {"header": header, "quality": quality, "state": state, "image_count": number}
                frame["camera_pose_source"] = 2
                ahead = {"x": 0.5, "y": -0.5, "z": 0.5, "w": -0.5}
                frame["body_to_camera"] = {"translation": {"x": 0.1 * number, "z": -1.0}, "rotation": ahead}
                frame["display_delay"] = 0.0 if number == 4 else 0.058
                if number != 5:  # image 5 has no frame state
                    bag.add("/xplane/camera/frame_state", "xplane_bridge/FrameState", ns, frame)
                info = {"header": header, "width": 32, "height": 24, "K": [30 + number, 0, 16, 0, 31, 12, 0, 0, 1]}
                if number != 6:
                    bag.add("/xplane/camera/camera_info", "sensor_msgs/CameraInfo", ns, info)
                if raw_images:
                    pixels = picture(number)[:, :, ::-1]
                    values = {"height": 24, "width": 32, "encoding": "rgb8", "step": 96, "data": pixels.reshape(-1)}
                    bag.add("/xplane/camera/image_raw", "sensor_msgs/Image", ns, {"header": header, **values})
                else:
                    data = cv2.imencode(".jpg", picture(number))[1]
                    values = {"format": "bgr8; jpeg compressed bgr8", "data": data.reshape(-1)}
                    topic = "/xplane/camera/image_raw/compressed"
                    bag.add(topic, "sensor_msgs/CompressedImage", ns, {"header": header, **values})
        for t, mode, failsafe in ((0.5, 1, False), (1.5, 2, False), (3.5, 2, True)):
            ns = stamp_ns(t + offset)
            values = {"header": bag.header(ns, ""), "mode": mode, "requested_by": "test", "reason": "r" * mode}
            values["failsafe"] = failsafe
            bag.add("/xplane/control/mode", "xplane_bridge/ControlMode", ns, values)
        ns = stamp_ns(1.0 + offset)
        failure = {
            "header": bag.header(ns, ""),
            "names": ["aileron1_left", "engine_1", "pitot_1"],
            "kinds": ["stuck", "failed", "failed"],
            "values": [5.0, math.nan, math.nan],
            "set_by": ["bridge"] * 3,
            "active": [True, True, False],
            "confirmed": [True] * 3,
            "since_sim_time": [1.0, 1.0, math.nan],
        }
        bag.add("/xplane/failures/state", "xplane_bridge/FailureState", ns, failure)
    return path


def export(*arguments: object) -> int:
    return bag_export.main([str(a) for a in arguments])


def files_of(folder: Path) -> dict:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def pictures_in(flight: Path) -> list[Path]:
    """The pictures of a flight's data set, those of every split."""
    return sorted(path for path in (flight / "images").rglob("*") if path.suffix in (".jpg", ".png"))
