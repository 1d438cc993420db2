"""What tests of tx_node share: X-Plane's datarefs seen from outside, sticks, parameters, services.

`world` is a test's namespace of nodes (tests/nodes/conftest.py).
"""

from __future__ import annotations

import json
import math
import threading
import time
from pathlib import Path
from typing import Any, Callable

from support.deadlines import WAIT_S
from xplane_bridge import protocol
from xplane_bridge.constants import ControlField, FlightMode, ResultCode
from xplane_bridge.harness.processes import wait_until
from xplane_bridge.harness.xplane_client import XPlaneClient
from xplane_bridge.resources import config_file

MANUAL, AUTO = FlightMode.MANUAL, FlightMode.AUTO
#: Bits of ControlCommand.fields.
ROLL, PITCH, YAW, THROTTLE = ControlField.ROLL, ControlField.PITCH, ControlField.YAW, ControlField.THROTTLE
FLAPS, GEAR = ControlField.FLAPS, ControlField.GEAR


class WatchedDatarefs:
    """X-Plane's datarefs, watched from outside the bridge.

    Args:
        port: X-Plane's, on this machine.
        paths: what to watch.
    """

    def __init__(self, port: int, *paths: str) -> None:
        self.paths = list(paths)
        self._client = XPlaneClient(port)
        self._known: dict[int, float] = {}
        self._asked = -math.inf
        self._ask()

    def _ask(self) -> None:
        """For what has not answered, once a second: X-Plane drops requests of which too many come at once."""
        if time.monotonic() < self._asked + 1.0:
            return
        self._asked = time.monotonic()
        for index, path in enumerate(self.paths):
            if index not in self._known:
                self._client.subscribe([path], rate_hz=50, first_index=index)

    def value(self, path: str) -> float:
        """The newest value; nan before the first."""
        self._ask()
        self._known.update(self._client.values())
        return self._known.get(self.paths.index(path), math.nan)

    def history(self, path: str) -> list[float]:
        """Its values that came since one was last asked for, of whatever path."""
        return [value for (value,) in self.samples(path)]

    def samples(self, *paths: str) -> list[tuple[float, ...]]:
        """The same of several: each time their values in one datagram, which are of one frame of X-Plane's."""
        found = []
        self._ask()
        wanted = [self.paths.index(path) for path in paths]
        for packet in self._client.received():
            values = dict(protocol.decode_rref_response(packet))
            self._known.update(values)
            if values.keys() >= set(wanted):
                found.append(tuple(values[index] for index in wanted))
        return found

    def wait(self, path: str, expected: float, timeout: float = WAIT_S, tolerance: float = 1e-4) -> None:
        """Waits until a dataref has a value."""
        wait_until(lambda: abs(self.value(path) - expected) <= tolerance, timeout, f"{path} = {expected}")

    def close(self) -> None:
        """Ends it."""
        self._client.close()


class CommandSource:
    """Publishes a ControlCommand again and again, as a stick or a controller does.

    Args:
        world: the test's namespace.
        topic: control/manual or control/auto.
    """

    def __init__(self, world: Any, topic: str) -> None:
        import rospy
        from xplane_bridge.msg import ControlCommand

        self.command = ControlCommand()
        self._publisher = rospy.Publisher(f"{world.namespace}/{topic}", ControlCommand, queue_size=1)
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def once(self, **values: Any) -> None:
        """Changes fields of the command and publishes it."""
        for key, value in values.items():
            setattr(self.command, key, value)
        wait_until(lambda: self._publisher.get_num_connections() > 0, WAIT_S, "tx_node's subscription")
        self._publisher.publish(self.command)

    def fly(self, **values: Any) -> None:
        """Changes fields of the command, and publishes it 50 times a second from now on."""
        self.once(**values)
        if self._thread is None:
            self._ended.clear()
            self._thread = threading.Thread(target=self._repeat, daemon=True)
            self._thread.start()

    def _repeat(self) -> None:
        while not self._ended.wait(0.02):
            self.command.sequence += 1
            self._publisher.publish(self.command)

    def stop(self) -> None:
        """Is silent from now on."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join(10)
            self._thread = None

    def let_go(self) -> None:
        """Centres the stick that it moves, and is silent: for the time-out, the last command flies on."""
        if self._thread is not None:
            self.once(roll=0.0, pitch=0.0, yaw=0.0)
        self.stop()


class RepeatedJoy:
    """A joystick that repeats what it shows 50 times a second, as joy_node with autorepeat does.

    Args:
        world: the test's namespace.
        axes: how many the device has; `axes` are changed in place, -1..1, left, up and forward positive.
        buttons: likewise; 1 is pressed.
    """

    def __init__(self, world: Any, axes: int, buttons: int) -> None:
        import rospy
        from sensor_msgs.msg import Joy

        self.axes, self.buttons = [0.0] * axes, [0] * buttons
        self._message = Joy
        self._publisher = rospy.Publisher(f"{world.namespace}/joy", Joy, queue_size=1)
        self._timer: Any = None

    def send(self) -> None:
        """Shows it once."""
        self._publisher.publish(self._message(axes=self.axes, buttons=self.buttons))

    def plug_in(self) -> None:
        """Repeats it from now on."""
        import rospy

        wait_until(lambda: self._publisher.get_num_connections() > 0, WAIT_S, "the mapper's subscription")
        self._timer = rospy.Timer(rospy.Duration(0.02), lambda _: self.send())

    def pull_out(self) -> None:
        """Is silent from now on."""
        if self._timer:
            self._timer.shutdown()
            self._timer.join()
            self._timer = None


#: [s] of tx_node: on a busy machine, one that stands still for a moment has not hung, and neither has X-Plane. What a
#: hang does, and that load is none, tests of their own show with the shipped time.
PATIENCE = {"hang_timeout": 30.0, "service_timeout": 10.0}


def tx_params(aircraft: str = "fixed_wing", **params: Any) -> dict[str, Any]:
    """tx_node's private parameters as tx.launch loads them, but for PATIENCE, with changes."""
    import yaml

    options = yaml.safe_load(config_file("tx.yaml").read_text(encoding="utf-8"))
    options["aircraft"] = yaml.safe_load(config_file("aircraft", f"{aircraft}.yaml").read_text(encoding="utf-8"))
    options.update({**PATIENCE, **params})
    return options


def journal_entries(world: Any) -> list[str]:
    """What the journals of the world's nodes say is to be undone."""
    entries: list[str] = []
    for file in (world.folder / "ros_home" / "xplane_bridge").glob("*.json"):
        if file.stem.endswith("_subscriptions"):
            continue
        try:
            text = file.read_text(encoding="utf-8")
        except FileNotFoundError:  # removed since it was listed: nothing is to be undone any more
            continue
        entries += [entry["id"] for entry in json.loads(text)["entries"]]
    return entries


def take_away(world: Any, path: str, seen: Callable[[], Any]) -> None:
    """Another client gives an override back until that is seen: the bridge's own refresh may come right after it."""
    wire = type(world).wire(world.xplane.port)

    def again() -> Any:
        wire.send(protocol.DrefWrite(path, 0.0))
        return seen()

    wait_until(again, WAIT_S, f"what follows when another client gives {path} back")


def call(world: Any, service: str, kind: str, /, **request: Any) -> Any:
    """Calls one of tx_node's services, of a type of xplane_bridge.srv; as `call_linked`."""
    import xplane_bridge.srv

    return call_linked(world, f"tx_node/{service}", getattr(xplane_bridge.srv, kind), **request)


def call_linked(world: Any, service: str, kind: type, /, **request: Any) -> Any:
    """Calls a service of the world's; again where it is refused for want of a link, which it is whenever the emulator's
    frames are late.
    """

    def answered() -> Any:
        answer = world.call(service, kind, **request)
        # What clear_failures clears is cleared without a link, too; there is nothing to clear the second time.
        refused = answer.result.code == ResultCode.NO_LINK and not service.endswith("/clear_failures")
        return None if refused else answer

    return wait_until(answered, WAIT_S, f"a link to X-Plane for {service}")


def pause(world: Any, paused: bool) -> None:
    """Has tx_node pause X-Plane or let it go on. Again where that is refused for want of a link: nothing was sent."""
    from std_srvs.srv import SetBool

    def done() -> bool:
        answer = world.call("tx_node/pause", SetBool, paused)
        assert answer.success or answer.message == "X-Plane is not connected", answer.message
        return bool(answer.success)

    wait_until(done, WAIT_S, "a link to X-Plane for pause")


#: How the emulator's twin moves its surfaces (docs/experiments/emulator.md), by hand: 15 down, 25 up, 13, 18, 27 deg.
LAW: dict[str, Any] = {  # name: slopes, travel
    "aileron1_wing2_left": ({"roll+": 15.0, "roll-": 25.0}, (-25.0, 15.0)),
    "aileron1_wing2_right": ({"roll+": -25.0, "roll-": -15.0}, (-25.0, 15.0)),
    "elevator1_left": ({"pitch+": -18.0, "pitch-": -13.0}, (-18.0, 13.0)),
    "elevator1_right": ({"pitch+": -18.0, "pitch-": -13.0}, (-18.0, 13.0)),
    "rudder1_fin1": ({"yaw+": 27.0, "yaw-": 27.0}, (-27.0, 27.0)),
    "flap1_wing1_left": ({"flap1": 42.0}, (0.0, 42.0)),
    "flap1_wing1_right": ({"flap1": 42.0}, (0.0, 42.0)),
}


def write_mixing(world: Any) -> Path:
    """The mixing file of the emulator's twin, as docs/control/mixing_file.md describes it."""
    folder = world.folder / "ros_home" / "xplane_bridge" / "mixing"
    folder.mkdir(parents=True)
    surfaces = {
        name: {"slopes_deg": slopes, "residual_deg": 0.01, "low_deg": travel[0], "high_deg": travel[1]}
        for name, (slopes, travel) in LAW.items()
    }
    model = {
        "format": "xplane_bridge mixing",
        "version": 1,
        "aircraft": "DA62",
        "samples": 300,
        "level": {"trim_roll": 0.0, "trim_pitch": 0.0, "trim_yaw": 0.0, "speedbrake": 0.0, "flap2": 0.0},
        "surfaces": surfaces,
    }
    (folder / "DA62.yaml").write_text(json.dumps(model), encoding="utf-8")
    return folder / "DA62.yaml"
