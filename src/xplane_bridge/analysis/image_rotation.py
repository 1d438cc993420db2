"""How far the picture turned about its optical axis from one to the next, by tracked features."""

from __future__ import annotations

from typing import Any, Iterable, Optional

import cv2
import numpy as np

from xplane_bridge.analysis.latency import Motion

#: Two pictures are compared that are less than this apart [s].
MAX_PAUSE_S = 0.2
_FEATURES = 300
_MIN_INLIERS = 25
_MAX_TURN_RAD = 0.35


def rotation_between(before: np.ndarray, after: np.ndarray, mask: Optional[np.ndarray] = None) -> Optional[float]:
    """Angle that the camera turned about its line of sight, clockwise as the pilot sees it [rad].

    Args:
        before: Grey picture.
        after: The next one, of equal size.
        mask: Where features may lie (not 0); parts that do not move with the scene are left out.

    Returns:
        None when too few features could be followed.
    """
    corners = cv2.goodFeaturesToTrack(before, _FEATURES, 0.01, 7, mask=mask)
    if corners is None or len(corners) < _MIN_INLIERS:
        return None
    window: dict[str, Any] = {
        "nextPts": None,  # OpenCV's types want an array here
        "winSize": (21, 21),
        "maxLevel": 3,
        "criteria": (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 0.003),
    }
    moved, found, _ = cv2.calcOpticalFlowPyrLK(before, after, corners, **window)
    back, returned, _ = cv2.calcOpticalFlowPyrLK(after, before, moved, **window)
    good = (found[:, 0] == 1) & (returned[:, 0] == 1) & (np.abs(back - corners).max(axis=(1, 2)) < 0.3)
    if good.sum() < _MIN_INLIERS:
        return None
    similarity, inliers = cv2.estimateAffinePartial2D(
        corners[good], moved[good], method=cv2.RANSAC, ransacReprojThreshold=1.0
    )
    if similarity is None or inliers.sum() < _MIN_INLIERS:
        return None
    # The scene turns against the camera; rows point down, so a positive angle of the picture is clockwise.
    angle = -float(np.arctan2(similarity[1, 0], similarity[0, 0]))
    return angle if abs(angle) < _MAX_TURN_RAD else None


def rotation_motion(pictures: Iterable[tuple[float, np.ndarray]], ignore_bottom: float = 0.0) -> Motion:
    """Turns between neighbouring pictures.

    Args:
        pictures: Stamp [s] and grey picture, in time order.
        ignore_bottom: Share of the height at the lower edge that does not show the scene (instruments).
    """
    begin, end, turn = [], [], []
    before: Optional[tuple[float, np.ndarray]] = None
    mask = None
    for stamp, picture in pictures:
        if mask is None or mask.shape != picture.shape:
            mask = np.full(picture.shape, 255, np.uint8)
            mask[round(picture.shape[0] * (1.0 - ignore_bottom)) :] = 0
        if before is not None and 0.0 < stamp - before[0] < MAX_PAUSE_S and before[1].shape == picture.shape:
            angle = rotation_between(before[1], picture, mask)
            if angle is not None:
                begin.append(before[0])
                end.append(stamp)
                turn.append(angle)
        before = stamp, picture
    return Motion(np.array(begin), np.array(end), np.array(turn))
