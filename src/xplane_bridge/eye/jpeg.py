"""JPEG of pictures as the grabbers give them: by simplejpeg where it is installed, else by OpenCV at the same cost."""

from __future__ import annotations

import importlib
from typing import Any, Callable

from xplane_bridge.errors import XplaneBridgeError

#: Makes JPEG bytes of rows x columns x 4 of BGRX.
Encode = Callable[[Any], bytes]


class JpegError(XplaneBridgeError):
    """There is nothing that makes JPEG."""


def encoder(quality: int) -> Encode:
    """The encoder that this computer has.

    Args:
        quality: 1..100

    Raises:
        JpegError: It has none.
    """
    try:
        simplejpeg = importlib.import_module("simplejpeg")
    except ImportError:
        return _by_opencv(quality)

    def encode(pixels: Any) -> bytes:
        jpeg: bytes = simplejpeg.encode_jpeg(
            pixels, quality=quality, colorspace="BGRX", colorsubsampling="420", fastdct=True
        )
        return jpeg

    return encode


def _by_opencv(quality: int) -> Encode:
    try:
        cv2 = importlib.import_module("cv2")
    except ImportError:
        raise JpegError("neither simplejpeg nor OpenCV is here: run pip install 'xplane_bridge[eye]'") from None

    def encode(pixels: Any) -> bytes:
        return bytes(cv2.imencode(".jpg", pixels[:, :, :3], [cv2.IMWRITE_JPEG_QUALITY, quality])[1])

    return encode
