"""Pictures on a busy computer: shown late by the emulator, or seen late by a program that does not come to run."""

from __future__ import annotations

import csv
import random
import signal
import time
from pathlib import Path
from typing import Any, Callable

import numpy as np

from xplane_bridge.emulator.view.renderer import StripError, StripReading, read_strip
from xplane_bridge.harness import HarnessError, ManagedProcess


def complete_rows(file: Path) -> list[dict[str, str]]:
    """The complete rows of a CSV file that is still being written, or whose writer was killed."""
    return list(csv.DictReader(file.read_text(encoding="utf-8").rpartition("\n")[0].splitlines()))


def display_delays(swaps: Path) -> dict[int, float]:
    """From each frame of the emulator's swap log to its picture on the screen [s]."""
    offset_ns = time.time_ns() - time.monotonic_ns()  # the log has frame times on the monotonic clock
    return {
        int(row["frame"]): (int(row["swap_end_ns"]) - offset_ns - int(row["frame_monotonic_ns"])) * 1e-9
        for row in complete_rows(swaps)
    }


def punctual_frames(swaps: Path, delay_s: float, frame_rate: float) -> set[int]:
    """Frames of the swap log whose pictures appeared when they were due; late ones say nothing about the pairing.

    Args:
        swaps: the log.
        delay_s: when they are due, after their frame [s].
        frame_rate: a fifth of a frame earlier or later is punctual [Hz].
    """
    return {frame for frame, delay in display_delays(swaps).items() if abs(delay - delay_s) < 0.2 / frame_rate}


def pixels(image: Any) -> np.ndarray:
    """Those of a sensor_msgs/Image in bgr8, of shape (height, width, 3)."""
    return np.frombuffer(image.data, np.uint8).reshape(image.height, image.width, 3)


def decoded(jpeg: Any) -> np.ndarray:
    """The pixels of a sensor_msgs/CompressedImage, likewise."""
    import cv2

    return cv2.imdecode(np.frombuffer(jpeg.data, np.uint8), cv2.IMREAD_COLOR)


def seldom(log: Any, condition: Callable[[], bool], further: int = 20) -> Callable[[], bool]:
    """A condition that looks at all pictures, for what asks it all the time: that takes time their programs have not.

    Args:
        log: Of a topic with a message for each picture.
        condition: What is asked.
        further: Only after so many further messages.
    """
    looked = -further

    def asked() -> bool:
        nonlocal looked
        if len(log.messages) < looked + further:
            return False
        looked = len(log.messages)
        return condition()

    return asked


class ShownFrames:
    """Which frames of the emulator's window images show, each read once.

    Args:
        images: sensor_msgs/Image, of a topic that may bring more.
    """

    def __init__(self, images: list[Any]) -> None:
        self._images = images
        self._read = 0
        self._by_stamp: dict[Any, StripReading] = {}

    def by_stamp(self) -> dict[Any, StripReading]:
        """Those of all images so far."""
        for image in self._images[self._read :]:
            self._read += 1
            try:
                self._by_stamp[image.header.stamp] = read_strip(pixels(image))
            except StripError:
                if self._by_stamp:
                    raise
                # the window is black before its first frame
        return self._by_stamp

    def judged(self, states: list[Any], swaps: Path, delay_s: float, frame_rate: float) -> list[tuple]:
        """Perfectly paired pictures of `punctual_frames`: the FrameState and what is shown."""
        shown, punctual = self.by_stamp(), punctual_frames(swaps, delay_s, frame_rate)
        perfect = [state for state in list(states) if state.quality == 0 and state.header.stamp in shown]
        pairs = [(state, shown[state.header.stamp]) for state in perfect]
        return [(state, frame) for state, frame in pairs if frame.frame in punctual]


def joined(log: Any, *others: Any) -> list[Any]:
    """Messages of a topic's log whose stamps all others have, too: a busy computer loses some of a queue of two."""
    stamps = [{message.header.stamp for message in list(other.messages)} for other in others]
    return [message for message in list(log.messages) if all(message.header.stamp in each for each in stamps)]


def schedule_late(
    process: ManagedProcess, period_s: float, enough: Callable[[], bool], timeout_s: float = 90.0
) -> None:
    """Stops a program again and again for most of a frame, until there is enough.

    Args:
        process: it.
        period_s: of the frames [s].
        enough: whether there is.
        timeout_s: how long there may not be.

    Raises:
        HarnessError: there was not.
    """
    draw, deadline = random.Random(3), time.monotonic() + timeout_s
    while not enough():
        if time.monotonic() > deadline:
            raise HarnessError(f"not enough within {timeout_s:g} s")
        time.sleep(draw.uniform(0.5, 2.0) * period_s)
        process.send_signal(signal.SIGSTOP)
        time.sleep(draw.uniform(0.5, 1.1) * period_s)
        process.send_signal(signal.SIGCONT)
