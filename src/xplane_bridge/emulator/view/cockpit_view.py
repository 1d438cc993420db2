"""Hands each frame of the emulator to the windows that draw its views."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import List, Tuple

import numpy as np

from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.frame import MPS_TO_FPM, MPS_TO_KT
from xplane_bridge.emulator.options import Options
from xplane_bridge.emulator.simulator import Simulator
from xplane_bridge.emulator.view.renderer import RendererError, RendererOptions, RendererProcess, Scene
from xplane_bridge.emulator.view.renderer.scene import Row
from xplane_bridge.emulator.windows import WindowView
from xplane_bridge.protocol import ROW_COUNT


class CockpitView:
    """What the pilot sees, in a window, and further windows with views of their own; see `pictures.View`.

    The aerodrome lies where the options say, else where the flight starts, its runway along the first heading. Further
    windows lie right of the first.

    Raises:
        RendererError: A window cannot be opened.
    """

    def __init__(self, options: Options) -> None:
        self._views = (WindowView(0.0, 0.0), *options.more_windows)
        self._renderers: List[RendererProcess] = []
        try:
            for number in range(len(self._views)):
                self._renderers.append(RendererProcess(_renderer_options(options, number)))
        except RendererError:
            self.close()
            raise

    def show(self, sim: Simulator) -> None:
        """Has the frame drawn whose packets were just sent."""
        frame = sim.frame
        camera = sim.cameras.drawn(frame)
        forward, right, down = (float(part) for part in camera.lever)
        horizontal, vertical, shift_right, shift_up = sim.cameras.field_of_view()
        scene = Scene(
            frame=sim.clocks.frame,
            time_ns=time.monotonic_ns(),
            sim_time=sim.clocks.running,
            latitude_deg=frame.m.latitude_deg,
            longitude_deg=frame.m.longitude_deg,
            altitude_m=frame.m.altitude_m,
            terrain_m=frame.m.terrain_elevation_m,
            roll_deg=frame.true_phi,
            pitch_deg=frame.true_theta,
            heading_deg=frame.true_psi,
            eye_forward_m=forward,
            eye_right_m=right,
            eye_down_m=down,
            floor_down_m=camera.floor_down,
            field_of_view_deg=horizontal,
            vertical_field_of_view_deg=vertical,
            shift_right=shift_right,
            shift_up=shift_up,
            airspeed_kt=frame.m.calibrated_airspeed_mps * MPS_TO_KT,
            vertical_speed_fpm=-frame.m.v_down_mps * MPS_TO_FPM,
            others=sim.traffic.poses(),
            rows=_printed(sim),
        )
        for view, renderer in zip(self._views, self._renderers):
            renderer.show(_seen(scene, view, camera.turn))

    def drawn(self, timeout_s: float) -> bool:
        """Whether that is done (or the window gone) in all windows; waits for it so long.

        In lock-step it is done when the pictures are on display.
        """
        end = time.monotonic() + timeout_s
        return all(renderer.drawn(max(end - time.monotonic(), 0.0)) for renderer in self._renderers)

    @property
    def alive(self) -> bool:
        """Whether all windows are still there."""
        return all(renderer.alive for renderer in self._renderers)

    def close(self) -> None:
        """Closes the windows."""
        for renderer in self._renderers:
            renderer.close()


def _renderer_options(options: Options, number: int) -> RendererOptions:
    initial, (width, height) = options.initial, options.window_size
    here = (initial.latitude_deg, initial.longitude_deg, initial.heading_deg)
    latitude, longitude, heading = options.aerodrome or here
    swap_log = options.swap_log
    if swap_log is not None and number:
        swap_log = swap_log.with_name(f"{swap_log.stem}_{number + 1}{swap_log.suffix}")
    return RendererOptions(
        anchor=(latitude, longitude),
        runway_heading_deg=heading,
        width=width,
        height=height,
        pipeline_delay=options.pipeline_delay,
        hud=options.hud,
        strip=options.strip,
        swap_log=swap_log,
        realtime=options.realtime,
        answers_shown=options.stepped == "lockstep",
        place=(number * width, 0) if options.more_windows else None,
    )


def _printed(sim: Simulator) -> Tuple[Row, ...]:
    """Rows of the Data Output table that clients want on the screen."""
    numbers = np.flatnonzero(sim.store.array("sim/network/dataout/data_to_screen")[:ROW_COUNT])
    if not len(numbers):
        return ()
    return tuple((float(number), *values) for number, values in zip(numbers, sim.rows.of(numbers).tolist()))


def _seen(scene: Scene, view: WindowView, first: np.ndarray) -> Scene:
    """The scene with a window's own camera, turned in the aircraft from the first window's."""
    turn = first @ earth.body_to_level(view.roll_deg, view.pitch_deg, view.heading_deg)
    roll, pitch, heading = earth.euler_degrees(turn)
    scene = replace(scene, head_roll_deg=roll, head_pitch_deg=pitch, head_heading_deg=heading)
    if not view.field_of_view_deg:
        return scene
    own = view.field_of_view_deg
    return replace(scene, field_of_view_deg=own, vertical_field_of_view_deg=0.0, shift_right=0.0, shift_up=0.0)
