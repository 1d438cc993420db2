"""The whole emulator: a simulator, its sockets, and X-Plane's loop around them.

One rendered frame: take what clients sent, fly the frame's time, send what is due, then draw the picture (`View`). The
next frame does not begin before the picture is drawn.
"""

from __future__ import annotations

import json
import logging
import math
import os
import socket
import sys
import time
from typing import Any, Callable, Dict, List, Optional, TextIO

import numpy as np

from xplane_bridge import protocol
from xplane_bridge.emulator.aircraft import create_model
from xplane_bridge.emulator.aircraft.kinematic.kinematic import KinematicModel
from xplane_bridge.emulator.datarefs.aircraft_systems import Weather
from xplane_bridge.emulator.datarefs.control_inputs import InputOptions
from xplane_bridge.emulator.flight.flight_model import FlightModel
from xplane_bridge.emulator.lockstep import Fences, LockstepLoop
from xplane_bridge.emulator.options import KINEMATIC, Options
from xplane_bridge.emulator.pictures import View, wait_until_shown
from xplane_bridge.emulator.priority import RealTimePriority, collect_seldom, collected_by_hand
from xplane_bridge.emulator.scenario_pilot import ScenarioPilot, load_flown, started_as
from xplane_bridge.emulator.simulator import INTERNAL_VERSIONS, Simulator
from xplane_bridge.emulator.truth import TruthFile
from xplane_bridge.emulator.wire.faults import FaultyChannel
from xplane_bridge.emulator.wire.server import Beacon, Route, Server
from xplane_bridge.emulator.wire.subscriptions import Address, Subscriptions
from xplane_bridge.emulator.wire.xplane_connect import XPlaneConnect

_LOG = logging.getLogger(__name__)

#: Periods of the newest frames are kept for the closing statistics.
_KEPT_PERIODS = 100_000
#: Frames that begin later than this last as long as they really do [s].
_SCHEDULER_JITTER_S = 0.001
#: Of X-Plane's own dialogues; whether requests may ask for more is a question [1/s].
_HIGHEST_RATE_HZ = 99
#: Longest wait without looking whether to stop [s].
_PATIENCE_S = 0.25


class Emulator:
    """See the module's text.

    Attributes:
        sim: The simulator; another object after a restart.
        port: The port it listens on.
        view: What draws the pictures; None: there are none.
        wants_status: Set it to have the statistics printed between two frames, as a `STATUS {json}` line.
        options: Those given, with the start of the pilot's scenario where they have none.
    """

    def __init__(self, options: Options) -> None:
        self._scenario = None if options.pilot is None else load_flown(options.pilot, options.aircraft)
        self.options = options if self._scenario is None else started_as(self._scenario, options)
        self.period = 1.0 / options.fps
        self.view: Optional[View] = None
        self.stopping = False
        self.wants_status = False
        self._channel: FaultyChannel[Route] = FaultyChannel(options.fault, options.seed)
        self._fences = Fences() if options.stepped == "lockstep" else None
        self._lockstep: Optional[LockstepLoop] = None
        self.sim = self._new_simulator()
        self._server: Optional[Server] = self._new_server(options.port)
        self.port = self._server.port
        self._xplane_connect_port = options.xplane_connect_port
        self._xplane_connect = self._new_xplane_connect()
        self._beacon = self._new_beacon()
        self._truth = TruthFile(options.truth, self.sim.model) if options.truth is not None else None
        self._frames = 0
        self._truth_frame = -1
        self._picture = 0  # number of the frame that the window shows
        self._run_began = 0  # frames before the run: lock-step numbers those of each run from 1
        self._loading_until = -math.inf
        self._sent_at: List[float] = []
        self._jitter = np.random.default_rng(options.seed)

    # --- construction -------------------------------------------------------------------------------------------------

    def _make_model(self, name: str) -> FlightModel:
        return KinematicModel(self.options.seed) if name == KINEMATIC else create_model(name, self.options.seed)

    def _new_xplane_connect(self) -> Optional[XPlaneConnect]:
        port = self._xplane_connect_port
        if port is None:
            return None
        return XPlaneConnect(
            self.options.bind,
            port,
            lambda: self.sim.position(),
            lambda: self.sim.model.state.terrain_elevation_m,
            lambda name: self.sim.store.get(name),
        )

    def _new_simulator(self) -> Simulator:
        o = self.options
        pilot = None if self._scenario is None else ScenarioPilot(self._scenario, self.options.version)
        inputs = InputOptions(o.joystick == "attached", o.auto_coordination)
        sim = Simulator(
            self._make_model,
            o.aircraft,
            version=o.version,
            initial=o.initial,
            sim_time_start=o.sim_time_start,
            data_rate=o.rate,
            bracket_names=o.bracket_names,
            surface_failures=o.surface_failures == "act",
            totals_move=o.overridden_totals == "move",
            load_time=o.load_time,
            pilot=pilot,
            inputs=inputs,
            window_size=o.window_size,
            otherwise=o.otherwise,
            traffic=o.traffic,
            weather=Weather(*o.wind, o.turbulence),
            aerodrome=o.aerodrome,
        )
        sim.on_rows(protocol.RowSelection("DSEL", o.data_rows))
        return sim

    def _new_server(self, port: int) -> Server:
        sim = self.sim
        handlers: Dict[type, Callable[..., Any]] = {
            protocol.RrefRequest: self._on_rref,
            protocol.RposRequest: self._on_rpos,
            protocol.NetworkTarget: self._on_target,
            protocol.RecoverAll: lambda _request, _sender: sim.repair_all(),
            protocol.DrefWrite: self._on_dref,
            protocol.DataPacket: lambda request, _: sim.on_data(request),
            protocol.CommandRequest: lambda request, _: sim.on_command(request),
            protocol.RowSelection: lambda request, _: sim.on_rows(request),
            protocol.Placement: lambda request, _: sim.on_placement(request),
            protocol.AircraftLoad: lambda request, _: sim.on_aircraft(request),
            protocol.AircraftLoadAndPlacement: lambda request, _: (
                sim.on_aircraft(request.load) or sim.on_placement(request.placement)
            ),
            protocol.Situation: lambda request, _: sim.on_situation(request),
            protocol.VehiclePose: lambda request, _: sim.on_vehicle(request),
        }
        o = self.options
        subscriptions = Subscriptions(o.rref_split, replaces="same-index" not in o.otherwise)
        # Whatever is lost would have to be asked for again by wall time.
        limit = o.request_limit if self._fences is None else sys.maxsize
        server = Server(o.bind, port, handlers, subscriptions, self._channel, limit, o.answer_from)
        server.data_target = o.data_target
        if self._fences is not None:
            server.hold()
        return server

    def _new_beacon(self) -> Optional[Beacon]:
        o = self.options
        if not o.beacon:
            return None
        message = protocol.Beacon(INTERNAL_VERSIONS[o.version], self.port, socket.gethostname())
        return Beacon(o.bind, message, o.beacon_group, o.beacon_port, o.second_beacon)

    # --- requests that concern the wire -------------------------------------------------------------------------------

    def _on_dref(self, request: protocol.DrefWrite, sender: Address) -> Optional[str]:
        if self._fences is not None and self._fences.write(request, sender):
            return None
        return self.sim.on_dref(request)

    def _on_rref(self, request: protocol.RrefRequest, sender: Address) -> Optional[str]:
        if self._fences is not None and self._fences.request(request, sender):
            return None
        subscriptions = self.server.subscriptions
        if request.rate_hz <= 0:
            subscriptions.stop_rref(sender, request.index)
            return None
        if request.rate_hz > _HIGHEST_RATE_HZ and "rate-above-99" in self.options.otherwise:
            return "rate"
        slot = self.sim.store.find(request.path)
        if slot is None:
            if self.options.unknown_datarefs == "omit":
                return "dataref"
            slot = self.sim.unknown_slot
        subscriptions.request_rref(sender, request.index, request.rate_hz, slot)
        return None

    def _on_rpos(self, request: protocol.RposRequest, sender: Address) -> Optional[str]:
        self.server.subscriptions.request_rpos(sender, request.rate_hz)
        return None

    def _on_target(self, request: protocol.NetworkTarget, _sender: Address) -> Optional[str]:
        if request.index != protocol.DATA_OUTPUT_TARGET:
            return "target"
        try:
            socket.inet_aton(request.host)
        except OSError:
            return "target"
        good = request.enabled and request.port > 0
        self.server.data_target = (request.host, request.port) if good else None
        return None

    @property
    def server(self) -> Server:
        """The sockets; RuntimeError while X-Plane is away (restart)."""
        if self._server is None:
            raise RuntimeError("the emulator is between two runs")
        return self._server

    # --- one frame ----------------------------------------------------------------------------------------------------

    def run_frame(self, period: float, now: float, host_time: float = math.nan) -> None:
        """One rendered frame.

        Args:
            period: Time since the frame before [s].
            now: Time of this frame on the loop's clock [s].
            host_time: Host time for the truth file [s].
        """
        server, sim = self.server, self.sim
        self._frames += 1
        if now < self._loading_until:  # requests wait in the socket
            return
        if self._reads_a_load(server):
            self._loading_until = now + self.options.loading_time
            return
        sim.step(period)
        if self.options.send_while_paused or not sim.clocks.paused:
            self._send(now, max(period, self.period))
        server.flush_delayed(now)
        if self._xplane_connect is not None:
            self._xplane_connect.answer()
        if self._fences is None:
            self._write_truth(host_time)
        if self.view is not None and self._picture_is_due():
            self.view.show(sim)
            if self._fences is None:
                self._wait_for_picture(self.view)
            else:
                wait_until_shown(self.view, self._frames, lambda: self.stopping)
            self._picture = self._frames - self._run_began

    def _picture_is_due(self) -> bool:
        if self._frames % 2 and "window-changes" in self.options.otherwise:
            return False
        return self._picture == 0 or (self._frames - self._run_began - 1) % self.options.picture_every == 0

    def _send(self, now: float, period: float) -> None:
        sim = self.sim
        self.server.send_frame(
            now,
            period,
            sim.rows,
            sim.store.values,
            sim.selected_rows,
            sim.data_rate,
            self._rpos_packet,
            sim.table.plan,
        )

    def _write_truth(self, host_time: float = math.nan) -> None:
        sim = self.sim
        # In lock-step also asked for after frames that have not happened: files are read, X-Plane is away.
        if self._truth is not None and sim.flying and sim.clocks.frame != self._truth_frame:
            self._truth_frame = sim.clocks.frame
            self._truth.write(sim.frame, host_time)

    def _reads_a_load(self, server: Server) -> bool:
        """Takes what clients sent, up to a request that has files loaded; returns whether there was one."""
        sim, loads = self.sim, self.sim.loads
        takes_time = self.options.loading_time > 0.0
        server.receive(self.options.deaf, lambda: takes_time and sim.loads != loads)
        return takes_time and sim.loads != loads

    def _wait_for_picture(self, view: View) -> None:
        """Waits as X-Plane's loop does until the frame is drawn; sends delayed datagrams on the way."""
        stepped = self.options.stepped is not None
        while not self.stopping:
            due = math.inf if stepped else self._channel.next_due()
            if view.drawn(min(max(due - time.monotonic(), 0.0), _PATIENCE_S)):
                return
            if not stepped and self._server is not None:
                self._server.flush_delayed(time.monotonic())

    def _rpos_packet(self) -> bytes:
        return self.sim.position().encode()

    # --- loops --------------------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Flies until `stopping` is set or the duration is over.

        Raises:
            OSError: The port was taken while a restart was played, or in lock-step the window is gone.
        """
        try:
            with np.errstate(over="ignore"):  # of a number that is infinite as float32; not in each frame, which costs
                if self.options.stepped == "fast":
                    self._run_fast()
                elif self.options.stepped == "lines":
                    self._run_lines(sys.stdin, sys.stdout)
                else:
                    with collected_by_hand():
                        if self._fences is not None:
                            self._run_lockstep(self._fences)
                        else:
                            self._run_real_time()
        finally:
            self.close()

    def _run_real_time(self) -> None:
        clock, o = time.monotonic, self.options
        priority = RealTimePriority(o.realtime)
        start = deadline = clock()
        last = start - self.period
        while not self.stopping:
            self._wait_until(deadline)
            begin = clock()
            elapsed = begin - start
            if o.duration is not None and elapsed >= o.duration:
                break
            if self._pause_for_faults(elapsed):
                deadline = clock()
                continue
            # Simulated time is the time that passed; what the scheduler adds to every wait is kept out of it.
            started = begin if begin - deadline > _SCHEDULER_JITTER_S else deadline
            period, last = started - last, started
            if self._beacon is not None:
                self._beacon.poll(begin)
            self.run_frame(period, begin, time.time())
            self._print_wanted_status()
            end = clock()
            self.sim.clocks.work = end - begin
            if len(self._sent_at) < _KEPT_PERIODS:
                self._sent_at.append(begin)
            collect_seldom(self._frames)
            priority.watch()
            # A frame that takes too long (its picture, mostly) makes the next one late, and the frame rate fall.
            deadline = max(deadline + self.period + self._jitter.uniform(0.0, o.frame_jitter), end)

    def _wait_until(self, deadline: float) -> None:
        """Sleeps until the deadline; sends delayed datagrams on the way."""
        while not self.stopping:
            now = time.monotonic()
            due = self._channel.next_due() if self._server is not None else math.inf
            if due <= now and self._server is not None:
                self._server.flush_delayed(now)
                continue
            remaining = min(deadline, due) - now
            if remaining <= 0.0:
                return
            time.sleep(min(remaining, _PATIENCE_S))

    def _pause_for_faults(self, elapsed: float) -> bool:
        """Sits out a freeze; goes away and comes back for a restart. Returns whether it did either."""
        freeze, restart = self.options.fault.freeze, self.options.fault.restart
        if freeze is not None and freeze.covers(elapsed):
            self._wait_until(time.monotonic() + freeze.start_s + freeze.duration_s - elapsed)
            return True
        if restart is not None and restart.covers(elapsed):
            self.leave()
            self._wait_until(time.monotonic() + restart.start_s + restart.duration_s - elapsed)
            self.come_back()
            return True
        return False

    def leave(self) -> None:
        """What clients see when X-Plane is quit: the port is closed, the beacon gone."""
        self._close_sockets()
        self._server = None

    def come_back(self) -> None:
        """Starts anew on the same ports: no subscriptions, no targets, no overrides, a new flight."""
        self.sim = self._new_simulator()
        self._server = self._new_server(self.port)
        self._xplane_connect = self._new_xplane_connect()
        self._beacon = self._new_beacon()

    def step_frames(self, count: int) -> None:
        """Stepped mode: `count` frames of the nominal period, whatever the wall clock says."""
        for _ in range(count):
            self._print_wanted_status()
            elapsed = self._frames * self.period
            if not self._stepped_fault(elapsed):
                self.run_frame(self.period, elapsed)
            else:
                self._frames += 1

    def _stepped_fault(self, elapsed: float) -> bool:
        """Faults by frame time: whether this frame does not happen."""
        freeze, restart = self.options.fault.freeze, self.options.fault.restart
        away = restart is not None and restart.covers(elapsed)
        if away and self._server is not None:
            self.leave()
        elif not away and self._server is None:
            self.come_back()
        return away or (freeze is not None and freeze.covers(elapsed))

    def _run_fast(self) -> None:
        frames = round((self.options.duration or 0.0) * self.options.fps)
        while self._frames < frames and not self.stopping:
            self.step_frames(1)

    def _begin_run(self) -> None:
        self._run_began, self._picture = self._frames, 0

    def _after_fence(self) -> None:
        self._write_truth()
        collect_seldom(self._frames)

    def _run_lockstep(self, fences: Fences) -> None:
        o = self.options
        self._lockstep = LockstepLoop(
            lambda: self.server,
            fences,
            self._begin_run,
            lambda: self.step_frames(1),
            self._after_fence,
            lambda now: self._send(now, self.period),
            lambda: self.sim.clocks.running,
            lambda: self._picture,
            self._print_wanted_status,
            self.period,
            o.pace,
        )
        self._lockstep.run(None if o.duration is None else round(o.duration * o.fps), lambda: self.stopping)

    def _run_lines(self, lines: TextIO, answers: TextIO) -> None:
        """The stepping protocol: a line with a number of frames in, `STEPPED {json}` out; `quit` or the end ends it."""
        for line in lines:
            text = line.strip()
            if text == "quit" or self.stopping:
                break
            if not text:
                continue
            if not text.isdecimal():
                print(f"stepping: expected a number of frames or 'quit', got '{text}'", file=sys.stderr, flush=True)
                continue
            self.step_frames(int(text))
            report = {"frame": self.sim.clocks.frame, "sim_time": self.sim.clocks.running}
            print("STEPPED " + json.dumps(report), file=answers, flush=True)

    # --- reports ------------------------------------------------------------------------------------------------------

    def describe(self) -> Dict[str, Any]:
        """What the READY line says."""
        o = self.options
        return {
            "port": self.port,
            "bind": o.bind,
            "pid": os.getpid(),
            "version": o.version,
            "aircraft": o.aircraft,
            "fps": o.fps,
            "beacon": o.beacon,
            "xpc_port": None if self._xplane_connect is None else self._xplane_connect.port,
            "stepped": o.stepped is not None,
            "pipeline_delay": o.pipeline_delay,
        }

    def statistics(self) -> Dict[str, Any]:
        """What the closing line says; periods [ms] are those between the starts of frames."""
        report: Dict[str, Any] = {"frames": self._frames, "sim_time": self.sim.clocks.running}
        if self._server is not None:
            report["ignored"] = dict(self._server.ignored)
            report["subscriptions"] = self._server.subscriptions.count_by_client()
        if self._lockstep is not None:
            report["waited_s"] = self._lockstep.waited
        if len(self._sent_at) > 2:
            errors = np.abs(np.diff(self._sent_at) - self.period) * 1e3
            report["period_error_ms"] = {
                "p50": round(float(np.percentile(errors, 50)), 3),
                "p99": round(float(np.percentile(errors, 99)), 3),
                "max": round(float(errors.max()), 3),
            }
        return report

    def _print_wanted_status(self) -> None:
        if self.wants_status:
            self.wants_status = False
            print("STATUS " + json.dumps(self.statistics()), flush=True)

    def _close_sockets(self) -> None:
        self.server.close()
        if self._xplane_connect is not None:
            self._xplane_connect_port = self._xplane_connect.port
            self._xplane_connect.close()
            self._xplane_connect = None
        if self._beacon is not None:
            self._beacon.close()
            self._beacon = None

    def close(self) -> None:
        """Closes sockets and files; may be called again."""
        if self._server is not None:
            self._close_sockets()
        if self._truth is not None:
            self._truth.close()
            self._truth = None
