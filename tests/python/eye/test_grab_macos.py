"""The eye's way of reading a window on macOS: its arithmetic, and all of it with stand-ins for macOS' frameworks."""

from __future__ import annotations

import sys
import threading
import types
from typing import Any, Callable, Dict, List, Tuple

import numpy as np
import pytest

from support.kept_problems import KeptProblems
from xplane_bridge.eye import grab_macos
from xplane_bridge.eye.grab_macos import Content, MacGrabber, is_full_screen
from xplane_bridge.harness import wait_until

LONGEST_S = 60.0
TITLE_BAR = 28.0  #: [points]
RETINA = 2.0
SCREEN = 0, 0, 640, 400  #: [points]


def test_a_picture_has_the_window_without_its_title_bar():
    retina = Content(0.0, 0.0, 400.0, 328.0, scale=1.0, px_per_point=2.0)
    assert retina.inside(28.0, (800, 656)) == (0, 56, 800, 656)
    assert retina.inside(0.0, (800, 656)) == (0, 0, 800, 656)
    assert Content(0.0, 0.0, 400.0, 328.0, 1.0, 1.0).inside(28.0, (400, 328)) == (0, 28, 400, 328)
    # A window that has become twice as large as the picture is scaled down, with its title bar.
    assert Content(0.0, 0.0, 400.0, 328.0, 0.5, 2.0).inside(28.0, (800, 656)) == (0, 28, 800, 656)
    # One that has become smaller leaves a black edge; what is not in the picture is not read.
    assert Content(10.0, 5.0, 200.0, 128.0, 1.0, 2.0).inside(28.0, (800, 656)) == (20, 66, 420, 266)
    assert Content(0.0, 0.0, 400.4, 328.4, 1.0, 2.0).inside(28.0, (800, 656)) == (0, 56, 800, 656)
    assert Content(0.0, 0.0, 400.0, 20.0, 1.0, 2.0).inside(28.0, (800, 656)) is None


def test_the_windows_own_size_does_not_depend_on_the_pictures():
    whole = Content(0.0, 0.0, 400.0, 328.0, scale=1.0, px_per_point=2.0)
    halved = Content(0.0, 0.0, 200.0, 164.0, scale=0.5, px_per_point=2.0)
    assert whole.own_size == halved.own_size == (800, 656)
    assert Content(0.0, 0.0, 400.0, 328.0, scale=0.5, px_per_point=2.0).own_size == (1600, 1312)


@pytest.mark.parametrize(
    ("window", "is_it"),
    [
        ((0, 0, 1512, 982), True),
        ((0, 32, 1512, 950), True),  # below the notch
        ((0, 38, 1512, 860), False),  # above the Dock
        ((100, 100, 800, 628), False),
        ((-1920, 0, 1920, 1080), False),
    ],
)
def test_only_a_window_that_fills_the_display_has_no_title_bar(window: tuple, is_it: bool):
    assert is_full_screen(window, (0, 0, 1512, 982)) == is_it


def rect(x: float, y: float, width: float, height: float) -> Any:
    size = types.SimpleNamespace(width=width, height=height)
    return types.SimpleNamespace(origin=types.SimpleNamespace(x=x, y=y), size=size)


class Desktop:
    """One window of X-Plane, its title bar white; its place can be changed [points]."""

    def __init__(self, place: Tuple[float, ...]) -> None:
        self.place = place
        self.streams = 0
        self.fault: Any = None  #: with which the next stream's start ends

    def windows(self) -> list:
        return [
            types.SimpleNamespace(
                frame=lambda place=self.place: rect(*place), title=lambda: "X-Plane", windowID=lambda: 7
            )
        ]

    def displays(self) -> list:
        return [types.SimpleNamespace(frame=lambda: rect(*SCREEN))]

    def sample(self, size: Tuple[int, int], shade: int) -> Dict[str, Any]:
        """What a stream of this size [px] delivers: the window, made smaller where it does not fit, the rest black."""
        place = self.place
        _, _, width, height = place
        scale = min(1.0, size[0] / (width * RETINA), size[1] / (height * RETINA))
        bar = 0.0 if is_full_screen(place, SCREEN) else TITLE_BAR
        picture = np.zeros((size[1], size[0], 4), np.uint8)
        end = round(height * RETINA * scale), round(width * RETINA * scale)
        picture[: end[0], : end[1]] = shade
        picture[: round(bar * RETINA * scale), : end[1]] = 255
        area = rect(0.0, 0.0, width * scale, height * scale)
        return {"status": 0, "area": area, "scale": scale, "factor": RETINA, "picture": picture}


class Said(KeptProblems, MacGrabber):
    pass


class Made:
    """A class of Objective-C: made by alloc and init."""

    @classmethod
    def alloc(cls) -> Any:
        return cls.__new__(cls)

    def init(self) -> Any:
        return self


def frameworks(desktop: Desktop) -> Dict[str, Any]:
    class Filter(Made):
        def initWithDesktopIndependentWindow_(self, _: Any) -> Any:  # noqa: N802
            return self

        def pointPixelScale(self) -> float:  # noqa: N802
            return RETINA

    class Settings(Made):
        def __getattr__(self, name: str) -> Callable[[Any], None]:
            return lambda value: self.__dict__.__setitem__(name, value)

    class Stream(Made):
        def initWithFilter_configuration_delegate_(self, _: Any, settings: Any, output: Any) -> Any:  # noqa: N802
            self.size, self.output, self.end = (settings.setWidth_, settings.setHeight_), output, threading.Event()
            return self

        def addStreamOutput_type_sampleHandlerQueue_error_(self, *_: Any) -> None:  # noqa: N802
            pass

        def startCaptureWithCompletionHandler_(self, done: Callable[[Any], None]) -> None:  # noqa: N802
            desktop.streams += 1
            fault, desktop.fault = desktop.fault, None
            if isinstance(fault, Exception):
                raise fault
            done(fault)
            threading.Thread(target=self.deliver, daemon=True).start()

        def deliver(self) -> None:
            shade = 0
            while not self.end.wait(0.02):
                shade = (shade + 1) % 200 + 1
                self.output.stream_didOutputSampleBuffer_ofType_(self, desktop.sample(self.size, shade), 0)

        def stopCaptureWithCompletionHandler_(self, _: Any) -> None:  # noqa: N802
            self.end.set()

    class Buffer:
        def __init__(self, sample: Dict[str, Any]) -> None:
            self.picture = sample["picture"]

        def as_buffer(self, length: int) -> bytes:
            assert length == self.picture.nbytes
            return self.picture.tobytes()

    kit = types.SimpleNamespace(
        SCShareableContent=types.SimpleNamespace(
            getShareableContentWithCompletionHandler_=lambda take: take(desktop, None)
        ),
        SCContentFilter=Filter,
        SCStreamConfiguration=Settings,
        SCStream=Stream,
        SCStreamFrameInfoStatus="status",
        SCStreamFrameInfoContentRect="area",
        SCStreamFrameInfoContentScale="scale",
        SCStreamFrameInfoScaleFactor="factor",
    )
    media = types.SimpleNamespace(
        CMTimeMake=lambda *_: None,
        CMSampleBufferGetSampleAttachmentsArray=lambda sample, _: [sample],
        CMSampleBufferGetImageBuffer=Buffer,
    )
    video = types.SimpleNamespace(
        CGRectMakeWithDictionaryRepresentation=lambda area, _: (True, area),
        CVPixelBufferLockBaseAddress=lambda *_: None,
        CVPixelBufferUnlockBaseAddress=lambda *_: None,
        CVPixelBufferGetWidth=lambda buffer: buffer.picture.shape[1],
        CVPixelBufferGetHeight=lambda buffer: buffer.picture.shape[0],
        CVPixelBufferGetBytesPerRow=lambda buffer: buffer.picture.strides[0],
        CVPixelBufferGetBaseAddress=lambda buffer: buffer,
    )

    def inner(frame: Any, style: int) -> Any:
        assert style == 1
        return rect(frame.origin.x, frame.origin.y, frame.size.width, frame.size.height - TITLE_BAR)

    app = types.SimpleNamespace(NSWindow=types.SimpleNamespace(contentRectForFrameRect_styleMask_=inner))
    objc = types.SimpleNamespace(lookUpClass=lambda _: Made, super=super)
    return {"ScreenCaptureKit": kit, "CoreMedia": media, "Quartz": video, "AppKit": app, "objc": objc}


@pytest.fixture(name="desktop")
def fixture_desktop(monkeypatch: pytest.MonkeyPatch) -> Desktop:
    desktop = Desktop((50.0, 20.0, 400.0, 328.0))
    monkeypatch.setattr(grab_macos, "_SEARCH_S", 0.05)
    for name, framework in frameworks(desktop).items():
        monkeypatch.setitem(sys.modules, name, framework)
    return desktop


def test_pictures_have_the_displays_resolution_and_follow_the_windows_size(desktop: Desktop):
    pictures: List[np.ndarray] = []
    grabber = MacGrabber(("X-Plane",), None, lambda pixels, *_: pictures.append(pixels))
    grabber.start()
    try:
        for place, shape in (
            ((50.0, 20.0, 400.0, 328.0), (600, 800, 4)),
            ((50.0, 20.0, 200.0, 178.0), (300, 400, 4)),
            ((50.0, 20.0, 500.0, 378.0), (700, 1000, 4)),
            (tuple(map(float, SCREEN)), (800, 1280, 4)),
        ):
            before = desktop.streams
            desktop.place = place
            wait_until(lambda: pictures and pictures[-1].shape == shape, LONGEST_S, "pictures")  # noqa: B023
            assert desktop.streams <= before + 1
    finally:
        grabber.stop()
    assert not any((picture[[0, -1]] == 255).any() or (picture[-1, -1] == 0).any() for picture in pictures)
    assert len({picture.shape for picture in pictures}) == 4


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        (RuntimeError("no such selector"), "macOS gives no pictures of X-Plane's window: no such selector"),
        ("the user declined", "macOS ended the capture: the user declined"),
    ],
)
def test_a_stream_that_does_not_start_is_said_and_begun_again(desktop: Desktop, fault: Any, text: str):
    desktop.fault = fault
    pictures: List[np.ndarray] = []
    grabber = Said(("X-Plane",), None, lambda pixels, *_: pictures.append(pixels))
    grabber.start()
    try:
        wait_until(lambda: pictures, LONGEST_S, "pictures")
    finally:
        grabber.stop()
    assert grabber.problems[-2:] == [text, ""]
    assert desktop.streams == 2
