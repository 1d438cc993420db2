"""Pictures of X-Plane's window on macOS, by ScreenCaptureKit. Experimental: never run by us.

macOS asks for two permissions of the terminal that starts `xplane_eye`: Screen Recording for the pictures, and Local
Network for X-Plane's datagrams and for `capture_node`.
"""

from __future__ import annotations

import importlib
import threading
import time
from typing import Any, List, Optional, Tuple

import numpy as np

from xplane_bridge.eye.grab import Grabber, GrabError, Rect, Take, Which

_SEARCH_S = 0.5
_ANSWER_S = 5.0
_BGRA = 0x42475241  # kCVPixelFormatType_32BGRA
_READ_ONLY = 1  # kCVPixelBufferLock_ReadOnly
_COMPLETE = 0  # SCFrameStatusComplete
_SCREEN = 0  # SCStreamOutputTypeScreen
_MOST_RATE = 120


class MacGrabber(Grabber):
    """Reads the window with X-Plane's title.

    Raises:
        GrabError: pyobjc's ScreenCaptureKit is not installed.
    """

    def __init__(self, titles: Tuple[str, ...], which: Which, take: Take) -> None:
        super().__init__(titles, which, take)
        try:
            self._kit = importlib.import_module("ScreenCaptureKit")
            self._media = importlib.import_module("CoreMedia")
            self._video = importlib.import_module("Quartz")
            self._objc = importlib.import_module("objc")
        except ImportError as error:
            raise GrabError(f"{error}: run pip install 'xplane_bridge[eye]'") from None

    def run(self) -> None:
        """Looks for the window and has it streamed until the end."""
        while not self._stop.is_set():
            window = self._find()
            if window is None:
                self._stop.wait(_SEARCH_S)
            else:
                self._stream(window)

    def _find(self) -> Optional[Any]:
        answered = threading.Event()
        found: List[Any] = []

        def take(content: Any, error: Any) -> None:
            if content is None:
                self.problem = f"macOS shows no windows ({error}): allow Screen Recording for this terminal"
            else:
                found.extend(content.windows())
            answered.set()

        self._kit.SCShareableContent.getShareableContentWithCompletionHandler_(take)
        if not answered.wait(_ANSWER_S) or not found:
            return None
        fitting = [(_place(window), window) for window in found if window.title() in self._titles]
        if fitting:
            return self._chosen(fitting)
        self.problem = self._no_window(tuple(str(window.title()) for window in found if window.title()))
        return None

    def _stream(self, window: Any) -> None:
        kit, area = self._kit, window.frame().size
        settings = kit.SCStreamConfiguration.alloc().init()
        settings.setWidth_(int(area.width))
        settings.setHeight_(int(area.height))
        settings.setPixelFormat_(_BGRA)
        settings.setShowsCursor_(False)
        settings.setMinimumFrameInterval_(self._media.CMTimeMake(1, _MOST_RATE))
        content = kit.SCContentFilter.alloc().initWithDesktopIndependentWindow_(window)
        output = self._output_class().alloc().init()
        stream = kit.SCStream.alloc().initWithFilter_configuration_delegate_(content, settings, output)
        stream.addStreamOutput_type_sampleHandlerQueue_error_(output, _SCREEN, None, None)
        stream.startCaptureWithCompletionHandler_(lambda error: output.ended.set() if error else None)
        self.problem = ""
        while not output.ended.is_set() and not self._stop.wait(_SEARCH_S):
            pass
        stream.stopCaptureWithCompletionHandler_(lambda _: None)

    def _output_class(self) -> Any:
        """The delegate that ScreenCaptureKit calls."""
        grabber = self
        base = self._objc.lookUpClass("NSObject")

        class EyeOutput(base):  # type: ignore[misc, valid-type]
            """Takes pictures, and the stream's end."""

            def init(self) -> Any:
                """As NSObject's."""
                me = grabber._objc.super(EyeOutput, self).init()
                me.ended = threading.Event()
                return me

            def stream_didOutputSampleBuffer_ofType_(self, _stream: Any, sample: Any, _kind: int) -> None:  # noqa: N802
                """A picture, or the news that nothing has changed."""
                grabber.take_sample(sample)

            def stream_didStopWithError_(self, _stream: Any, error: Any) -> None:  # noqa: N802
                """The window was closed, or the permission taken back."""
                grabber.problem = f"macOS ended the capture: {error}"
                self.ended.set()

        return EyeOutput

    def take_sample(self, sample: Any) -> None:
        """Hands a picture over, where the sample carries a new one."""
        now_ns = time.perf_counter_ns()
        attachments = self._media.CMSampleBufferGetSampleAttachmentsArray(sample, False)
        status = attachments[0].get(self._kit.SCStreamFrameInfoStatus) if attachments else None
        buffer = self._media.CMSampleBufferGetImageBuffer(sample)
        if status != _COMPLETE or buffer is None:
            return
        video = self._video
        video.CVPixelBufferLockBaseAddress(buffer, _READ_ONLY)
        try:
            height, pitch = video.CVPixelBufferGetHeight(buffer), video.CVPixelBufferGetBytesPerRow(buffer)
            memory = video.CVPixelBufferGetBaseAddress(buffer).as_buffer(height * pitch)
            lines = np.frombuffer(memory, np.uint8).reshape(height, pitch)
            pixels = lines[:, : 4 * video.CVPixelBufferGetWidth(buffer)].reshape(height, -1, 4).copy()
        finally:
            video.CVPixelBufferUnlockBaseAddress(buffer, _READ_ONLY)
        self._take(pixels, now_ns, 0)


def _place(window: Any) -> Rect:
    frame = window.frame()
    return int(frame.origin.x), int(frame.origin.y), int(frame.size.width), int(frame.size.height)
