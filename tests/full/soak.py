#!/usr/bin/env python3
"""Flies the bridge for simulated hours in lock-step, with much happening, and looks for what grows or is lost.

    python3 tests/full/soak.py --hours 8

Every two simulated minutes the flight begins anew at another place (the origin of X-Plane's local frame jumps); after
a third of the way another aircraft is loaded, which the bridge must leave alone, and then its own again; after two
thirds its own is loaded anew; half-way the bridge is ended and started again. Every frame must be published once, in
its order, and answered. The memory of each node may grow by 5 % and 4 MB after the first tenth.
"""

from __future__ import annotations

import argparse
import sys
import threading
from pathlib import Path
from typing import Any, Dict, List

from xplane_bridge.emulator.emulator import Emulator
from xplane_bridge.emulator.options import Options
from xplane_bridge.emulator.simulator import aircraft_path
from xplane_bridge.harness.lockstep_bridge import LockstepBridge

FPS = 60
PLACES = ((47.2, 8.4), (46.4, 7.1), (35.8, 139.6))  # latitude, longitude [deg]
RESET_EVERY_S = 120.0  # or six times in a short soak
SHARE, ROOM_KB = 0.05, 4096
NODES = ("rx_node", "tx_node")
AIRCRAFT, OTHER_AIRCRAFT = "fixed_wing", "multirotor"


def resident_kb(name: str, node: str) -> int:
    """Memory of a node of the bridge [kB].

    Raises:
        AssertionError: It does not run.
    """
    for folder in Path("/proc").iterdir():
        try:
            words = (folder / "cmdline").read_bytes().split(b"\0")
            if words[0].endswith(node.encode()) and any(name.encode() in word for word in words[1:]):
                status = (folder / "status").read_text()
                return int(status.split("VmRSS:")[1].split()[0])
        except (OSError, IndexError):
            continue
    raise AssertionError(f"{node} of {name} does not run")


class Soak:
    """A bridge, an emulator in a thread, and what was seen of them."""

    def __init__(self, frames: int) -> None:
        self.frames = frames
        self.flown = 0
        self._period = min(int(RESET_EVERY_S * FPS), frames // 6)  # of flights begun anew [frames]
        between = self._period // 2
        third, two_thirds = (k * frames // 3 // self._period * self._period + between for k in (1, 2))
        self._loads = {third: OTHER_AIRCRAFT, third + self._period // 4: AIRCRAFT, two_thirds: AIRCRAFT}
        self.resets = self.loads = self.starts = 0
        self.memory: Dict[str, List[int]] = {}
        # By the number of the event, since the bridge was started.
        self.promised: Dict[int, str] = {}  #: service that has promised it
        self.events: Dict[int, Any] = {}  #: what came
        self.applied: List[float] = []  #: times [s] at which commands went to another aircraft than the bridge's own
        self._other = 0  #: number of the event by which that aircraft is there, while it is to be
        self._bridge = LockstepBridge()
        self._emulator: Emulator
        self._thread: threading.Thread

    def run(self) -> None:
        """Flies everything.

        Raises:
            AssertionError: Frames were lost, something was refused, or memory grew.
        """
        half = self.frames // 2
        try:
            for first, last in ((0, half), (half, self.frames)):
                self._start()
                self._fly(first, last)
                self._check_memory()
                self._check_events()
                self._stop()
        finally:
            self._bridge.close()

    def _start(self) -> None:
        self._emulator = Emulator(
            Options(bind="127.0.0.1", port=0, beacon=False, realtime=False, fps=FPS, stepped="lockstep", turbulence=0.5)
        )
        self._thread = threading.Thread(target=self._emulator.run, name="emulator", daemon=True)
        self._thread.start()
        self._state = self._bridge.begin(self._emulator.port, AIRCRAFT)
        self._listen()
        self.starts += 1
        self.memory = {node: [] for node in NODES}

    def _listen(self) -> None:
        import rospy
        from xplane_bridge.msg import AppliedCommand, EventList

        self.promised, self.events, self._other = {}, {}, 0

        def on_events(message: EventList) -> None:
            self.events.update((event.number, event) for event in message.events)

        def on_applied(message: AppliedCommand) -> None:
            loaded = self.events.get(self._other)
            if loaded is not None and message.header.stamp > loaded.stamp:
                self.applied.append(message.header.stamp.to_sec())

        rospy.Subscriber(f"/{self._bridge.name}/events", EventList, on_events)
        rospy.Subscriber(f"/{self._bridge.name}/control/applied", AppliedCommand, on_applied)

    def _stop(self) -> None:
        self._bridge.end()
        self._emulator.stopping = True
        self._thread.join()

    def _fly(self, first: int, last: int) -> None:
        count, period = int(self._state.frame_count), 1.0 / FPS
        for frame in range(first, last):
            if frame > first and frame % self._period == 0:
                self._begin_anew()
            if frame in self._loads:
                self._load(self._loads[frame])
            if (frame - first) % max(1, (last - first) // 20) == 0:
                for node in NODES:
                    self.memory[node].append(resident_kb(self._bridge.name, node))
            before = self._state
            self._state = self._bridge.answer(wings_level(before))
            step = (self._state.header.stamp - before.header.stamp).to_sec()
            count += 1
            assert int(self._state.frame_count) == count, (
                f"frame {frame}: number {self._state.frame_count}, not {count}"
            )
            # While a flight begins anew X-Plane is paused, and its time stands.
            stands = step == 0.0 and self._state.paused
            assert stands or 0.5 * period < step < 1.5 * period, f"frame {frame}: {step:.4f} s after the one before"
            self.flown += 1

    def _begin_anew(self) -> None:
        from xplane_bridge.srv import ResetFlight

        latitude, longitude = PLACES[self.resets % len(PLACES)]
        self._call(
            "reset_flight",
            ResetFlight,
            latitude=latitude,
            longitude=longitude,
            altitude_msl=2500.0,
            heading_true_deg=90.0,
            true_airspeed=65.0,
        )
        self.resets += 1

    def _load(self, aircraft: str) -> None:
        from xplane_bridge.srv import LoadAircraft

        self._other = 0
        number = self._call("load_aircraft", LoadAircraft, path=aircraft_path(aircraft))
        self._other = number if aircraft == OTHER_AIRCRAFT else 0
        self.loads += 1

    def _call(self, service: str, kind: Any, **fields: Any) -> int:
        """The number of the event that brings the outcome."""
        import rospy

        answer = rospy.ServiceProxy(f"/{self._bridge.name}/tx_node/{service}", kind)(**fields)
        assert answer.success, f"{service}: {answer.result.message}"
        self.promised[answer.event_number] = service
        return int(answer.event_number)

    def _check_events(self) -> None:
        for number, service in self.promised.items():
            assert number in self.events, f"{service}: nothing has come of it"
            assert self.events[number].success, f"{service}: {self.events[number].text}"
        assert not self.applied, f"commands went to the {OTHER_AIRCRAFT} at {self.applied[:5]} s"

    def _check_memory(self) -> None:
        for node, seen in self.memory.items():
            start, most = seen[len(seen) // 10], max(seen[len(seen) // 10 :])
            print(f"{node}: {start} kB after the first tenth, at most {most} kB")
            assert most <= start * (1.0 + SHARE) + ROOM_KB, f"{node} has grown from {start} to {most} kB"


def wings_level(state: Any) -> Dict[str, float]:
    """Fields of ControlCommand that keep an aircraft flying for hours."""
    return {
        "roll": min(max(-0.03 * state.roll_deg, -1.0), 1.0),
        "pitch": min(max(0.04 * (2.0 - state.pitch_deg), -1.0), 1.0),
        "yaw": 0.0,
        "throttle": 0.7,
    }


def main() -> int:
    """Runs the program."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=8.0, help="simulated (default: 8)")
    args = parser.parse_args()
    if not args.hours > 0.0:
        parser.error(f"--hours {args.hours:g}: expected more than 0")
    soak = Soak(round(args.hours * 3600.0 * FPS))
    try:
        soak.run()
    except AssertionError as error:
        print(f"soak: after {soak.flown} frames: {error}", file=sys.stderr)
        return 1
    print(
        f"{soak.flown} frames, {soak.flown / FPS / 60.0:.1f} min: none lost; {soak.resets} flights begun anew, "
        f"{soak.loads} aircraft loaded, the bridge started {soak.starts} times"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
