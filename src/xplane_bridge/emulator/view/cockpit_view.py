"""Hands each frame of the emulator to the window that draws the cockpit view."""

from __future__ import annotations

import time

from xplane_bridge.emulator.flight.frame import MPS_TO_FPM, MPS_TO_KT
from xplane_bridge.emulator.options import Options
from xplane_bridge.emulator.simulator import Simulator
from xplane_bridge.emulator.view.renderer import RendererOptions, RendererProcess, Scene

_VIEW = "sim/graphics/view/"


class CockpitView:
    """What the pilot sees, in a window; see `emulator.View`.

    The aerodrome lies where the flight starts, its runway along the first heading.

    Raises:
        RendererError: The window cannot be opened.
    """

    def __init__(self, options: Options) -> None:
        initial = options.initial
        self._renderer = RendererProcess(
            RendererOptions(
                anchor=(initial.latitude_deg, initial.longitude_deg),
                runway_heading_deg=initial.heading_deg,
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
        frame, get = sim.frame, sim.store.get
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
                head_heading_deg=get(_VIEW + "pilots_head_psi"),
                head_pitch_deg=get(_VIEW + "pilots_head_the"),
                head_roll_deg=get(_VIEW + "pilots_head_phi"),
                field_of_view_deg=min(max(get(_VIEW + "field_of_view_deg"), 5.0), 150.0),
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
