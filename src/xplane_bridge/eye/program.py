"""The eye: hears frames, sees pictures, brings both together and sends them, or verifies that they belong together."""

from __future__ import annotations

import math
import signal
import socket
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Optional, Tuple, Union

from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.eye.calibrate import Calibration, CalibrationError, UndoFile
from xplane_bridge.eye.grab import Grabber, GrabError, Take, Which
from xplane_bridge.eye.jpeg import encoder
from xplane_bridge.eye.pairing import Pairing
from xplane_bridge.eye.rref import Address, FrameStream, Heard
from xplane_bridge.eye.screen import TimesOnScreen
from xplane_bridge.eye.sender import Sender
from xplane_bridge.eye.verify import Findings, Verification

_LOOK_S = 0.02
_CALIBRATE_AGAIN_S = 2.0
#: Measurements of the delay that fail at the start, before pictures go out without it.
_MEASUREMENTS = 3
#: capture_node answers within so long, or is not there.
_ANSWER_S = 3.0
#: From here on neighbouring float32 numbers of simulator time are 8 ms apart: frames above 60/s share them.
_COARSE_KEY_S = 65536.0


@dataclass(frozen=True)
class EyeOptions:
    """What the user asks for.

    Attributes:
        receiver: Where `capture_node` listens, HOST, PORT; None: nothing is sent, the pairing is verified.
        xplane: Where X-Plane listens, HOST, PORT.
        titles: Of the window, exactly.
        window: Of several such windows: its number, counted from 0, the leftmost, then the topmost; or a point of the
            screen that it covers; None: the largest.
        token: Shared with `capture_node`; empty: none.
        quality: Of the JPEG, 1..100.
        delay_s: From a frame to its picture [s]; None: to be measured.
        calibrate: Whether it may be measured, at the start and on request.
        while_recorded: Whether also while the pictures are being recorded.
        local_port: UDP port that X-Plane answers to.
        undo_file: Where X-Plane's field of view is kept while it is changed.
    """

    receiver: Optional[Address]
    xplane: Address
    titles: Tuple[str, ...]
    window: Which
    token: str
    quality: int
    delay_s: Optional[float]
    calibrate: bool
    while_recorded: bool
    local_port: int
    undo_file: Path


class EyeError(XplaneBridgeError):
    """The eye cannot work as asked."""


def grabber_class() -> Callable[[Tuple[str, ...], Which, Take], Grabber]:
    """The grabber of this system; others' modules are not imported.

    Raises:
        GrabError: There is none.
    """
    if sys.platform.startswith("linux"):
        from xplane_bridge.eye.grab_linux import LinuxGrabber

        return LinuxGrabber
    if sys.platform == "win32":
        from xplane_bridge.eye.grab_windows import WindowsGrabber

        return WindowsGrabber
    if sys.platform == "darwin":
        from xplane_bridge.eye.grab_macos import MacGrabber

        return MacGrabber
    raise GrabError(f"there is no way to read windows on {sys.platform}; Windows, Linux and macOS have one")


def resolved(address: Address, what: str) -> Address:
    """An address in numbers.

    Raises:
        EyeError: The name is not known.
    """
    try:
        return socket.gethostbyname(address[0]), address[1]
    except OSError as error:
        raise EyeError(f"{what} {address[0]!r}: {error.strerror or error}; give a name or an IPv4 address") from None


class Eye:
    """The program while it runs.

    Args:
        options: As asked for.
        say: Prints what happens.
    """

    def __init__(self, options: EyeOptions, say: Callable[[str], None]) -> None:
        self._options = options
        self._say = say
        self._lock = threading.Lock()
        self._pairing = Pairing(options.delay_s)
        self._calibration: Optional[Calibration] = None
        self._field_of_view_deg = self._times_on_screen = math.nan
        self._size: Optional[Tuple[int, int]] = None
        self._publishing = False
        self._coarse_said = False
        self._delay_was_sure = True
        self._remark = ""
        self._give_back_s = 0.0  # when X-Plane is next asked to take its field of view back; inf: it has it
        xplane = resolved(options.xplane, "X-Plane's computer")
        name = "{}:{}".format(*xplane)
        self._undo = UndoFile(options.undo_file, name)
        self._grabber = grabber_class()(options.titles, options.window, self._on_picture)
        self._stream = FrameStream(xplane, options.local_port, self._on_frame)
        screen_file = options.undo_file.with_name(f"{options.undo_file.stem}_screen{options.undo_file.suffix}")
        undo = UndoFile(screen_file, name, "times_on_screen", "what X-Plane prints")
        self._screen = TimesOnScreen(self._stream.write, lambda: self._times_on_screen, undo)
        self._verification: Optional[Verification] = None
        if options.receiver is None:
            self._verification = Verification(say)
            self._sender: Union[Sender, Verification] = self._verification
        else:
            receiver = resolved(options.receiver, "capture_node's computer")
            number = options.window if isinstance(options.window, int) else 0
            self._sender = Sender(receiver, number, options.token, name, encoder(options.quality), say)

    @property
    def findings(self) -> Optional[Findings]:
        """What was found where the pairing is verified, in the end."""
        return self._verification.findings if self._verification else None

    def run(self) -> None:
        """Runs until Ctrl-C or SIGTERM; to verify the pairing, until that is done.

        Raises:
            VerifyError: No printed time could be read.
            ScreenError: X-Plane does not print it.
        """
        signal.signal(signal.SIGTERM, _end)
        with self._sender, self._stream:
            self._grabber.start()
            try:
                self._wait_for(lambda: self._stream.alive, "waiting for X-Plane at {}:{}".format(*self._options.xplane))
                self._prepare()
                if self._verification:
                    with self._screen:
                        self._say("X-Plane prints its times into the picture; learning its digits for half a minute")
                        self._work(self._verification.work)
                else:
                    self._work(lambda: None)
            finally:
                try:
                    self._give_back_at_the_end()
                finally:
                    self._grabber.stop()

    def _work(self, each_time: Callable[[], None]) -> None:
        with self._lock:
            self._publishing = True
        while not self.findings:
            self._sender.report_problem(self._problem())
            self._send_decided()
            self._watch_delay()
            self._report_remark()
            self._give_back()
            self._calibrate_on_request()
            each_time()
            time.sleep(_LOOK_S)

    # ------------------------------------------------------------------------------------------ other threads

    def _on_frame(self, heard: Heard) -> None:
        with self._lock:
            self._field_of_view_deg = heard.field_of_view_deg
            self._times_on_screen = heard.times_on_screen
            frame = self._pairing.add_frame(heard.arrival_ns, heard.key)
            if self._verification is not None:
                self._verification.add_frame(frame)
            if self._calibration is not None:
                self._calibration.add_frame(heard.arrival_ns, heard.field_of_view_deg)
            if heard.key > _COARSE_KEY_S and not self._coarse_said:
                self._coarse_said = True
                self._say(
                    "X-Plane has run for more than 18 h: its time is too coarse to distinguish frames above 60/s; "
                    "start it anew for exact pairing"
                )
        self._send_decided()

    def _on_picture(self, pixels: Any, change_ns: int, unseen_ns: int) -> None:
        with self._lock:
            if self._calibration is not None:
                self._calibration.add_picture(change_ns, pixels)
            if not self._publishing:
                return
            if self._size is not None and pixels.shape[:2] != self._size:
                self._pairing.doubt_delay()
            self._size = pixels.shape[:2]
            self._pairing.add_picture(change_ns, pixels, unseen_ns)

    def _send_decided(self) -> None:
        with self._lock:
            decisions = self._pairing.decided(time.perf_counter_ns())
        for decision in decisions:
            self._sender.offer(decision)

    # -------------------------------------------------------------------------------------------- this thread

    def _problem(self) -> str:
        if not self._stream.alive:
            return "X-Plane does not send its frames to the eye"
        return self._grabber.problem

    def _wait_for(self, condition: Callable[[], bool], what: str) -> None:
        said = False
        while not condition():
            self._sender.report_problem(what)
            self._refuse_request(what)
            if not said:
                said = True
                self._say(what)
            time.sleep(_LOOK_S)

    def _prepare(self) -> None:
        """Measures the delay, where that is wanted and can be; always gives back what a killed eye has left."""
        self._screen.restore()
        if self._left_alone():
            return
        failed = 0
        while failed < _MEASUREMENTS:
            self._wait_for(lambda: self._stream.alive, "waiting for X-Plane")
            self._wait_for(lambda: not self._grabber.problem, "waiting for X-Plane's window")
            try:
                if self._left_alone():  # a recording may have begun meanwhile
                    return
                self._measure()
            except CalibrationError as error:
                failed += not self._problem()  # one that the end of X-Plane or its window cut short says nothing
                self._sender.report_problem(f"not calibrated: {error}")
                self._refuse_request(f"xplane_eye still measures at its start, and has not yet: {error}")
                time.sleep(_CALIBRATE_AGAIN_S)
                continue
            return
        self._delay_was_sure = False
        self._say(
            f"delay: not measured, as {failed} measurements have failed; X-Plane's field of view is left alone now. "
            "Pictures are flagged DELAY_ASSUMED; --delay gives what is known, and capture_node's service "
            "calibrate_display_delay measures anew"
        )

    def _left_alone(self) -> bool:
        """Whether the delay is not to be measured now, which is said; gives back what was left changed then."""
        reason = self._why_not_measured()
        if not reason:
            return False
        self._new_calibration().restore()
        self._delay_was_sure = self._options.delay_s is not None
        self._say(reason)
        return True

    def _measure(self) -> str:
        """Measures the delay, which is used from then on; gives what there is to say of it.

        Raises:
            CalibrationError: It could not be measured; the one before stays.
        """
        self._sender.report_problem("the eye is calibrating")
        self._say("calibrating: X-Plane's field of view changes for about three seconds")
        calibration = self._new_calibration()
        with self._lock:
            self._calibration = calibration
        try:
            found = calibration.run(self._why_not_now)
        except CalibrationError as error:
            self._say(f"not calibrated: {error}")
            raise
        finally:
            self._give_back_s = 0.0
            with self._lock:
                self._calibration = None
        with self._lock:
            self._pairing.set_delay(found.delay_s)
        text = f"{1e3 * found.delay_s:.1f} ms, from {found.steps} steps that lie {1e3 * found.spread_s:.1f} ms from it"
        self._say(f"delay: {text}")
        return text

    def _calibrate_on_request(self) -> None:
        """Measures the delay anew where capture_node asks for it."""
        if not isinstance(self._sender, Sender):
            return
        number = self._sender.take_request()
        if number == 0:
            return
        reason = self._why_not_now()
        if reason:
            self._sender.answer(number, False, reason)
            return
        with self._lock:
            self._publishing = False
        try:
            self._sender.answer(number, True, self._measure())
        except CalibrationError as error:
            self._sender.answer(number, False, str(error))
        with self._lock:
            self._publishing = True

    def _refuse_request(self, reason: str) -> None:
        """Answers at once what cannot be done soon: capture_node gives up after a while, and may record then."""
        if isinstance(self._sender, Sender):
            number = self._sender.take_request()
            if number:
                self._sender.answer(number, False, reason)

    def _why_not_now(self) -> str:
        """Why X-Plane's view must not zoom, or no picture would show it; else empty."""
        if self._options.delay_s is not None or not self._options.calibrate:
            return (
                "xplane_eye was started with --delay or --no-calibrate, by which it leaves X-Plane's field of view "
                "alone: start it without"
            )
        problem = self._problem()
        if not problem and self._kept_by_a_recording():
            return (
                "capture_node's pictures are being recorded, and X-Plane's view would zoom in them: call before or "
                "after the recording"
            )
        return problem

    def _why_not_measured(self) -> str:
        """What is said of the delay where it is not to be measured; else empty."""
        if self._options.delay_s is not None:
            return f"delay: {1e3 * self._options.delay_s:.1f} ms, as given"
        if not self._options.calibrate:
            return "delay: not measured"
        if self._kept_by_a_recording():
            return (
                "delay: not measured, as capture_node's pictures are being recorded and X-Plane's view would zoom: "
                "they are flagged DELAY_ASSUMED; after the recording, capture_node's service calibrate_display_delay "
                "measures it; during one, xplane_eye --calibrate-now does"
            )
        return ""

    def _kept_by_a_recording(self) -> bool:
        """Whether X-Plane's view must not zoom, as it is being recorded."""
        if self._options.while_recorded or not isinstance(self._sender, Sender):
            return False
        return self._sender.recorded(_ANSWER_S)

    def _new_calibration(self) -> Calibration:
        return Calibration(self._stream.write, lambda: self._field_of_view_deg, self._undo)

    def _give_back(self) -> None:
        """Tries again what X-Plane, as it hung, did not take at the end of a measurement."""
        if time.monotonic() < self._give_back_s or not self._stream.alive:
            return
        try:
            self._new_calibration().restore()
            self._give_back_s = math.inf
        except CalibrationError:
            self._give_back_s = time.monotonic() + _CALIBRATE_AGAIN_S

    def _give_back_at_the_end(self) -> None:
        if self._give_back_s < math.inf:
            try:
                self._new_calibration().restore()
            except CalibrationError as error:
                self._say(str(error))

    def _report_remark(self) -> None:
        if self._grabber.remark != self._remark:
            self._remark = self._grabber.remark
            if self._remark:
                self._say(self._remark)

    def _watch_delay(self) -> None:
        with self._lock:
            sure = self._pairing.delay_is_sure
        if self._delay_was_sure and not sure and self._options.calibrate:
            if self._options.delay_s is None:
                remedy = "call capture_node's service calibrate_display_delay, or start xplane_eye anew"
            else:
                remedy = "start xplane_eye anew with another --delay, or without"
            self._say(
                "the delay has changed (the window's size, vertical sync?): pictures are flagged DELAY_ASSUMED; "
                + remedy
            )
        self._delay_was_sure = sure


def _end(_signal: int, _frame: Any) -> None:
    raise KeyboardInterrupt
