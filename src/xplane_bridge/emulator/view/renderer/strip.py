"""The machine-readable strip at the lower edge of each picture: which frame it shows.

Two rows of 40 black or white cells over the whole width, each 1/60 of the height: 32 bits frame number, 32 bits of the
simulator time's float32 as the wire carries it, 16 bits of CRC over both; most significant bit first, white = 1. Cells
are large enough to survive JPEG and scaling down to 320x240.
"""

from __future__ import annotations

import binascii
import struct
from dataclasses import dataclass

import numpy as np

COLUMNS = 40
ROWS = 2
#: Height of a row as a share of the picture's.
ROW_SHARE = 1.0 / 60.0
_BITS = COLUMNS * ROWS
_THRESHOLD = 128
#: Share of a cell, around its middle, that is looked at: its edges are blurred by scaling.
_INNER = 0.5


class StripError(ValueError):
    """There is no readable strip in the picture."""


@dataclass(frozen=True)
class StripReading:
    """What a strip says."""

    frame: int
    sim_time: float  #: [s] `sim/time/total_running_time_sec` of the frame, the float32 as sent


def strip_height(height: int) -> int:
    """Rows of pixels that the strip takes of a picture of this height."""
    return height - _row_edges(height)[0]


def draw_strip(picture: np.ndarray, frame: int, sim_time: float) -> None:
    """Draws the strip into a picture of 8-bit channels, in place."""
    payload = struct.pack(">If", frame & 0xFFFFFFFF, sim_time)
    payload += struct.pack(">H", binascii.crc_hqx(payload, 0xFFFF))
    bits = np.unpackbits(np.frombuffer(payload, np.uint8)).reshape(ROWS, COLUMNS)
    height, width = picture.shape[:2]
    columns = (np.arange(width) * COLUMNS // width).clip(0, COLUMNS - 1)
    edges = _row_edges(height)
    for row in range(ROWS):
        picture[edges[row] : edges[row + 1]] = (bits[row, columns] * 255)[np.newaxis, :, np.newaxis]


def read_strip(picture: np.ndarray) -> StripReading:
    """Reads the strip of a picture that shows the whole window, in grey or colour, at any size from 320x240.

    Raises:
        StripError: The checksum is wrong: no strip, cropped, or too small.
    """
    height, width = picture.shape[:2]
    first = int(height * (1.0 - ROWS * ROW_SHARE))
    grey = picture[first:] if picture.ndim == 2 else picture[first:, :, :3].mean(axis=2)
    top = height * (1.0 - ROWS * ROW_SHARE) - first
    bits = np.empty(_BITS, np.uint8)
    for row in range(ROWS):
        y0, y1 = _inner(top + row * height * ROW_SHARE, height * ROW_SHARE)
        band = grey[y0:y1].mean(axis=0)
        for column in range(COLUMNS):
            x0, x1 = _inner(column * width / COLUMNS, width / COLUMNS)
            bits[row * COLUMNS + column] = band[x0:x1].mean() >= _THRESHOLD
    payload = np.packbits(bits).tobytes()
    (check,) = struct.unpack(">H", payload[8:])
    if check != binascii.crc_hqx(payload[:8], 0xFFFF):
        msg = f"no readable strip in the picture of {width}x{height}: expected the emulator's whole window"
        raise StripError(msg)
    frame, sim_time = struct.unpack(">If", payload[:8])
    return StripReading(frame, sim_time)


def _row_edges(height: int) -> list[int]:
    return [round(height * (1.0 - (ROWS - row) * ROW_SHARE)) for row in range(ROWS + 1)]


def _inner(start: float, length: float) -> tuple[int, int]:
    first = round(start + 0.5 * (1.0 - _INNER) * length)
    return first, max(first + 1, round(start + 0.5 * (1.0 + _INNER) * length))
