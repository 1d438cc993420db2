"""Pictures of X-Plane's window on macOS, by ScreenCaptureKit. Experimental: never run by us.

macOS asks for two permissions of the terminal that starts `xplane_eye`: Screen Recording for the pictures, and Local
Network for X-Plane's datagrams and for `capture_node`.
"""

from __future__ import annotations

import importlib
import threading
import time
from dataclasses import dataclass
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
_TITLED = 1  # NSWindowStyleMaskTitled


@dataclass(frozen=True)
class Content:
    """Where a window lies in a sample's picture, as ScreenCaptureKit says it.

    Attributes:
        left: In the picture [points].
        top: In the picture [points].
        width: In the picture [points].
        height: In the picture [points].
        scale: Its size in the picture by its own size.
        px_per_point: Of the display; 2 on Retina.
    """

    left: float
    top: float
    width: float
    height: float
    scale: float
    px_per_point: float

    @property
    def own_size(self) -> Tuple[int, int]:
        """Width and height of the window on its display [px]."""
        factor = self.px_per_point / self.scale
        return round(self.width * factor), round(self.height * factor)

    def inside(self, title_bar: float, picture: Tuple[int, int]) -> Optional[Tuple[int, int, int, int]]:
        """The part of the picture that shows the window without its title bar: left, top, right, bottom [px].

        Args:
            title_bar: Its height on the display [points]; 0: the window has none.
            picture: Width and height of the picture [px].

        Returns:
            None where nothing of it is in the picture.
        """
        points = (self.left, self.top + title_bar * self.scale, self.left + self.width, self.top + self.height)
        left, top, right, bottom = (max(0, round(each * self.px_per_point)) for each in points)
        right, bottom = min(right, picture[0]), min(bottom, picture[1])
        return (left, top, right, bottom) if left < right and top < bottom else None


def is_full_screen(window: Rect, display: Rect) -> bool:
    """Whether a window fills a display, or all of it below a camera's notch; both in the desktop's points."""
    (x, y, width, height), (left, top, wide, high) = window, display
    return (x, width, y + height) == (left, wide, top + high) and y >= top


class MacGrabber(Grabber):
    """Reads the window with X-Plane's title.

    Raises:
        GrabError: pyobjc's ScreenCaptureKit is not installed.
    """

    def __init__(self, titles: Tuple[str, ...], which: Which, take: Take) -> None:
        super().__init__(titles, which, take)
        self._displays: List[Rect] = []
        try:
            self._kit = importlib.import_module("ScreenCaptureKit")
            self._media = importlib.import_module("CoreMedia")
            self._video = importlib.import_module("Quartz")
            self._app = importlib.import_module("AppKit")
            self._objc = importlib.import_module("objc")
        except ImportError as error:
            raise GrabError(f"{error}: run pip install 'xplane_bridge[eye]'") from None

    def run(self) -> None:
        """Looks for the window and has it streamed until the end."""
        while not self._stop.is_set():
            try:
                window = self._find()
                if window is not None:
                    self._stream(window)
            except Exception as error:  # of Objective-C, which has its own
                self.problem = f"macOS gives no pictures of X-Plane's window: {error}"
            self._stop.wait(_SEARCH_S)  # also after a stream: a window that changes its size takes its time

    def _find(self) -> Optional[Any]:
        answered = threading.Event()
        found: List[Any] = []

        def take(content: Any, error: Any) -> None:
            if content is None:
                self.problem = f"macOS shows no windows ({error}): allow Screen Recording for this terminal"
            else:
                found.extend(content.windows())
                self._displays = [_place(display) for display in content.displays()]
            answered.set()

        self._kit.SCShareableContent.getShareableContentWithCompletionHandler_(take)
        if not answered.wait(_ANSWER_S) or not found:
            return None
        fitting = [window for window in found if window.title() in self._titles]
        if fitting:
            return self._chosen([(_place(window), window) for window in fitting], fitting)
        self.problem = self._no_window(tuple(str(window.title()) for window in found if window.title()))
        return None

    def _number_of(self, window: Any) -> Any:
        return window.windowID()

    def _stream(self, window: Any) -> None:
        """Has pictures delivered until the window is closed or its size changes."""
        kit, area = self._kit, window.frame().size
        content = kit.SCContentFilter.alloc().initWithDesktopIndependentWindow_(window)
        # Of macOS 14; before, the pictures of a Retina display have half its resolution.
        scale = content.pointPixelScale() if hasattr(content, "pointPixelScale") else 1.0
        settings = kit.SCStreamConfiguration.alloc().init()
        settings.setWidth_(round(area.width * scale))
        settings.setHeight_(round(area.height * scale))
        settings.setPixelFormat_(_BGRA)
        settings.setShowsCursor_(False)
        settings.setMinimumFrameInterval_(self._media.CMTimeMake(1, _MOST_RATE))
        output = self._output_class().alloc().init()
        output.title_bar = self._title_bar(window)
        stream = kit.SCStream.alloc().initWithFilter_configuration_delegate_(content, settings, output)
        stream.addStreamOutput_type_sampleHandlerQueue_error_(output, _SCREEN, None, None)

        def started(error: Any) -> None:
            if error is not None:
                output.stream_didStopWithError_(stream, error)

        self.problem = ""
        stream.startCaptureWithCompletionHandler_(started)
        while not output.ended.is_set() and not self._stop.wait(_SEARCH_S):
            pass
        stream.stopCaptureWithCompletionHandler_(lambda _: None)

    def _title_bar(self, window: Any) -> float:
        """Its height [points]; ScreenCaptureKit does not know it: that of every window with one, on this macOS."""
        if any(is_full_screen(_place(window), display) for display in self._displays):
            return 0.0
        frame = window.frame()
        inner = self._app.NSWindow.contentRectForFrameRect_styleMask_(frame, _TITLED)
        return float(frame.size.height - inner.size.height)

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
                me.title_bar, me.own_size = 0.0, None
                return me

            def stream_didOutputSampleBuffer_ofType_(self, _stream: Any, sample: Any, _kind: int) -> None:  # noqa: N802
                """A picture, or the news that nothing has changed."""
                grabber.take_sample(sample, self)

            def stream_didStopWithError_(self, _stream: Any, error: Any) -> None:  # noqa: N802
                """The window was closed, or the permission taken back."""
                grabber.problem = f"macOS ended the capture: {error}"
                self.ended.set()

        return EyeOutput

    def take_sample(self, sample: Any, output: Any) -> None:
        """Hands a picture over, where the sample carries a new one; ends the output where the window's size changes."""
        now_ns = time.perf_counter_ns()
        attachments = self._media.CMSampleBufferGetSampleAttachmentsArray(sample, False)
        facts = attachments[0] if attachments else {}
        buffer = self._media.CMSampleBufferGetImageBuffer(sample)
        if facts.get(self._kit.SCStreamFrameInfoStatus) != _COMPLETE or buffer is None or output.ended.is_set():
            return
        content = self._content(facts)
        if content.own_size != (output.own_size or content.own_size):
            output.ended.set()
            return
        output.own_size = content.own_size
        video = self._video
        video.CVPixelBufferLockBaseAddress(buffer, _READ_ONLY)
        try:
            width, height = video.CVPixelBufferGetWidth(buffer), video.CVPixelBufferGetHeight(buffer)
            part = content.inside(output.title_bar, (width, height))
            if part is None:
                return
            pitch = video.CVPixelBufferGetBytesPerRow(buffer)
            memory = video.CVPixelBufferGetBaseAddress(buffer).as_buffer(height * pitch)
            lines = np.frombuffer(memory, np.uint8).reshape(height, pitch)
            pixels = lines[:, : 4 * width].reshape(height, width, 4)[part[1] : part[3], part[0] : part[2]].copy()
        finally:
            video.CVPixelBufferUnlockBaseAddress(buffer, _READ_ONLY)
        self._take(pixels, now_ns, 0)

    def _content(self, facts: Any) -> Content:
        kit = self._kit
        _, area = self._video.CGRectMakeWithDictionaryRepresentation(facts[kit.SCStreamFrameInfoContentRect], None)
        place = (area.origin.x, area.origin.y, area.size.width, area.size.height)
        scales = (facts[kit.SCStreamFrameInfoContentScale], facts[kit.SCStreamFrameInfoScaleFactor])
        return Content(*map(float, (*place, *scales)))


def _place(window: Any) -> Rect:
    frame = window.frame()
    return int(frame.origin.x), int(frame.origin.y), int(frame.size.width), int(frame.size.height)
