"""Hands each frame of the emulator to the window that draws the cockpit view."""

from __future__ import annotations

import time

from xplane_bridge.emulator.flight.frame import MPS_TO_FPM, MPS_TO_KT
from xplane_bridge.emulator.options import Options
from xplane_bridge.emulator.simulator import Simulator
from xplane_bridge.emulator.view.renderer import RendererOptions, RendererProcess, Scene


class CockpitView:
    """What the pilot sees, in a window; see `emulator.View`.

    The aerodrome lies where the options say, else where the flight starts, its runway along the first heading.

    Raises:
        RendererError: The window cannot be opened.
    """

    def __init__(self, options: Options) -> None:
        initial = options.initial
        here = (initial.latitude_deg, initial.longitude_deg, initial.heading_deg)
        latitude, longitude, heading = options.aerodrome or here
        self._renderer = RendererProcess(
            RendererOptions(
                anchor=(latitude, longitude),
                runway_heading_deg=heading,
                width=options.window_size[0],
                height=options.window_size[1],
                pipeline_delay=options.pipeline_delay,
                hud=options.hud,
                strip=options.strip,
                swap_log=options.swap_log,
                realtime=options.realtime,
            )
        )

    def show(self, sim: Simulator) -> None:
        """Has the frame drawn whose packets were just sent."""
        frame = sim.frame
        camera = sim.cameras.drawn(frame)
        roll, pitch, heading = camera.angles
        forward, right, down = (float(part) for part in camera.lever)
        horizontal, vertical, shift_right, shift_up = sim.cameras.field_of_view()
        self._renderer.show(
            Scene(
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
                head_heading_deg=heading,
                head_pitch_deg=pitch,
                head_roll_deg=roll,
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
            )
        )

    def drawn(self, timeout_s: float) -> bool:
        """Whether that is done (or the window gone); waits for it so long."""
        return self._renderer.drawn(timeout_s)

    def close(self) -> None:
        """Closes the window."""
        self._renderer.close()
