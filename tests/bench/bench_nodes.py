"""Benchmarks of the nodes, against a bare roscpp publisher and a rospy node in the same run."""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path
from typing import Callable, Dict, List, Sequence

from bench_offline import cpp_program
from measuring import measuring, report_of
from registry import Context, Measure, benchmark

from support.simulator.emulator_fixture import EmulatorFixture, XPlaneClient
from xplane_bridge import protocol
from xplane_bridge.harness import EmulatorProcess, HarnessError, ManagedProcess, RosMaster, wait_until
from xplane_bridge.harness.ports import free_udp_port
from xplane_bridge.harness.ros import roslaunch


def _socket_drops(pid: int) -> int:
    """Datagrams that the kernel dropped because the process did not fetch them in time, over all its UDP sockets."""
    inodes = set()
    for link in Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):
            target = os.readlink(link)
            if target.startswith("socket:["):
                inodes.add(target[len("socket:[") : -1])
    rows = Path("/proc/net/udp").read_text(encoding="ascii").splitlines()[1:]
    found = [row.split() for row in rows if row.split()[9] in inodes]
    if not found:
        raise HarnessError(f"process {pid} has no UDP socket")
    return sum(int(row[-1]) for row in found)


def _write_values(file: Path) -> None:
    """All datarefs of the emulator in flight, a line each."""
    with EmulatorFixture() as bench:
        bench.step(5)
        store = bench.sim.store
        with file.open("w", encoding="ascii") as out:
            for name in store.names():
                for index, value in enumerate(store.array(name)):
                    out.write(f"{name}[{index}] {float(value):.9g}\n")
                out.write(f"{name} {store.get(name):.9g}\n")


class _Field:
    """A ROS master, and nodes of one namespace that look for X-Plane at one port.

    Args:
        context: the benchmark's.
        rate: frames per second.
    """

    def __init__(self, context: Context, rate: float) -> None:
        self._context = context
        self.rate = rate
        self.folder = context.folder
        self.folder.mkdir(parents=True, exist_ok=True)
        self.port = free_udp_port()
        self._stack = contextlib.ExitStack()
        self.values = self.folder / "values.txt"

    def __enter__(self) -> _Field:
        _write_values(self.values)
        self.master = RosMaster(self.folder / "master")
        self._stack.enter_context(self.master)
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def start(self, name: str, command: Sequence[object]) -> ManagedProcess:
        """Starts a program under the master, until the end."""
        process = ManagedProcess(name, [str(part) for part in command], self.folder, env=self.master.env)
        self._stack.enter_context(process)
        return process

    def node(self, program: str, **params: object) -> ManagedProcess:
        """Starts one of the bridge's nodes in the namespace /bench."""
        shared = {"host": "127.0.0.1", "port": self.port, "listen_for_beacon": False}
        arguments = [f"_{key}:={value}" for key, value in params.items()]
        for key, value in shared.items():
            self._set_param(f"/bench/{key}", value)
        return self.start(program, [cpp_program(program), "__ns:=/bench", *arguments])

    def _set_param(self, key: str, value: object) -> None:
        import xmlrpc.client

        with xmlrpc.client.ServerProxy(self.master.uri) as master:
            master.setParam("/bench_nodes", key, value)

    def launch(self, file: str, **args: object) -> ManagedProcess:
        """Starts a launch file in the namespace /bench, pointed at this port."""
        where = {"ns": "bench", "host": "127.0.0.1", "port": self.port, "listen_for_beacon": False}
        process = roslaunch(self.master, self.folder, file, name=Path(file).stem, **where, **args)
        self._stack.enter_context(process)
        return process

    def rospy_rx(self) -> ManagedProcess:
        """The same node in rospy."""
        script = Path(__file__).with_name("rospy_rx.py")
        return self.start("rospy_rx", [sys.executable, script, "127.0.0.1", self.port, "/peer/flight_state"])

    def bare(self) -> ManagedProcess:
        """A publisher of the same message for each datagram that does nothing else."""
        return self.start("bare", [cpp_program("bench_bare_publisher"), "/bare/flight_state", self.port])

    def meter(self, **settings: object) -> ManagedProcess:
        """X-Plane's place on the wire and the stop watch; not waited for."""
        all_settings = {"port": self.port, "values": self.values, "rate": self.rate, **settings}
        pairs = [f"{key}={value}" for key, value in all_settings.items()]
        return self.start("bench_xplane", [cpp_program("bench_xplane"), *pairs])


@benchmark
def flight_state(context: Context) -> List[Measure]:
    """Flight datagram to subscriber at 100 Hz, against a bare publisher fed by datagrams and the same node in rospy."""
    with _Field(context, 100.0) as field:
        topics = "/bench/flight_state,/peer/flight_state,/bare/flight_state"
        meter = field.meter(seconds=context.seconds, topics=topics)
        ours, peer = field.node("rx_node"), field.rospy_rx()
        field.bare()
        with measuring(meter, [ours, peer]) as (use, peer_use):
            cpu, peer_cpu = use.cpu_percent(context.seconds), peer_use.cpu_percent(context.seconds)
            memory, peer_memory = use.memory_mb(), peer_use.memory_mb()
        report = report_of(meter, 60.0)
    rx, rospy_rx, bare = (report[key] for key in topics.split(","))
    return [
        Measure("datagram to callback, p50", rx["p50_us"], "us"),
        Measure("datagram to callback, p99", rx["p99_us"], "us"),
        Measure("datagram to bare publish to callback, p50", bare["p50_us"], "us"),
        Measure("datagram to bare publish to callback, p99", bare["p99_us"], "us"),
        Measure("the same in rospy, p50", rospy_rx["p50_us"], "us"),
        Measure("the same in rospy, p99", rospy_rx["p99_us"], "us"),
        Measure("rx_node / bare, p50", rx["p50_us"] / bare["p50_us"], "times", budget=1.2),
        Measure("rx_node / bare, p99", rx["p99_us"] / bare["p99_us"], "times", budget=2.0),
        Measure("rospy / rx_node, p50", rospy_rx["p50_us"] / rx["p50_us"], "times"),
        Measure("frames without a state", report["frames"] - rx["received"], "-", budget=0.0),
        Measure("CPU of rx_node", cpu, "% core"),
        Measure("CPU of rospy / of rx_node", peer_cpu / max(cpu, 1e-3), "times"),
        Measure("memory of rx_node", memory, "MB"),
        Measure("memory of rospy / of rx_node", peer_memory / memory, "times"),
    ]


@benchmark
def packet_rate(context: Context) -> List[Measure]:
    """1000 frames/s with 20 000 small packets/s beside them: socket losses and published states."""
    with _Field(context, 1000.0) as field:
        meter = field.meter(seconds=context.seconds, topics="/bench/flight_state", extra=20)
        ours = field.node("rx_node")
        meter.wait_for_line(r"^MEASURING", 90.0)
        drops = _socket_drops(ours.pid)
        with measuring(meter, [ours]) as (use,):
            cpu = use.cpu_percent(context.seconds)
            drops = _socket_drops(ours.pid) - drops
        report = report_of(meter, 60.0)
    received = report["/bench/flight_state"]["received"]
    return [
        Measure("packets offered", report["datagrams"] / report["elapsed_s"], "/s", budget=20000.0, at_least=True),
        Measure("packets lost at the socket", drops, "-", budget=0.0),
        Measure("frames offered", report["frames"] / report["elapsed_s"], "/s"),
        Measure("flight states / frames", received / report["frames"], "-", budget=1.0, at_least=True),
        Measure("CPU of rx_node", cpu, "% core"),
    ]


@benchmark
def link_return(context: Context) -> List[Measure]:
    """Time until silence is noticed, and until states flow again after X-Plane has come back."""
    outages = max(3, round(context.seconds / 4.0))
    with _Field(context, 60.0) as field:
        meter = field.meter(seconds=1.0, topics="/bench/flight_state", outages=outages, link_state="/bench/link_state")
        field.node("rx_node")
        report = report_of(meter, 120.0 + 12.0 * outages)
    noticed, back = sorted(report["silence_noticed_s"]), sorted(report["link_back_s"])
    return [
        Measure("silence noticed, median", noticed[len(noticed) // 2], "s"),
        Measure("silence noticed, longest", noticed[-1], "s", budget=0.5),
        Measure("states flow again, median", back[len(back) // 2], "s"),
        Measure("states flow again, longest", back[-1], "s", budget=1.0),
    ]


_AILERON = "sim/flightmodel/controls/wing2l_ail1def"
_STICK = "sim/joystick/yoke_roll_ratio"
_XBOX_ROLL_AXIS = 3


@benchmark
def control(context: Context) -> List[Measure]:
    """Joy message to datagram through joystick_mapper_node and tx_node, against two bare hops and sendto.

    The messages drift through a period of the nodes' timers; the worst phase is the slowest eighth of that period.
    """
    bare_port = free_udp_port()
    with _Field(context, 50.0) as field, EmulatorProcess(context.folder, ["--fps", "60"]) as emulator:
        script = cpp_program("bench_bare_hops")
        field.start("bare_mapper", [script, "mapper", "/bare/joy", "/bare/command", _XBOX_ROLL_AXIS])
        field.start("bare_sender", [script, "sender", "/bare/command", bare_port])
        settings = {
            "listen": field.port,
            "xplane": emulator.port,
            "joy": "/bench/joy",
            "bare_joy": "/bare/joy",
            "bare_port": bare_port,
            "axis": _XBOX_ROLL_AXIS,
            "seconds": context.seconds,
        }
        meter = field.start(
            "bench_control", [cpp_program("bench_control"), *(f"{key}={value}" for key, value in settings.items())]
        )
        field.launch("tx.launch")
        field.launch("joystick.launch", joy_config="xbox")
        report = report_of(meter, 120.0 + context.seconds)
    ours, bare = report["bridge"], report["bare"]
    worst, bare_worst = max(ours["phase_p50_us"]), max(bare["phase_p50_us"])
    measured = sum(p50 >= 0.0 for p50 in ours["phase_p50_us"])
    return [
        Measure("joy to datagram, p50", ours["p50_us"], "us"),
        Measure("joy to datagram, p99", ours["p99_us"], "us"),
        Measure("joy to datagram, p50 of the worst phase", worst, "us"),
        Measure("two bare hops and sendto, p50", bare["p50_us"], "us"),
        Measure("two bare hops and sendto, p99", bare["p99_us"], "us"),
        Measure("two bare hops, p50 of the worst phase", bare_worst, "us"),
        Measure("bridge / bare, p50", ours["p50_us"] / bare["p50_us"], "times", budget=1.2),
        Measure("bridge / bare, p99", ours["p99_us"] / bare["p99_us"], "times"),
        Measure("bridge / bare, p50 of the worst phases", worst / bare_worst, "times"),
        Measure("eighths of the period that were measured", measured, "-", budget=8.0, at_least=True),
        Measure("stick movements that did not arrive", ours["sent"] - ours["arrived"], "-", budget=0.0),
    ]


def _frames_until(client: XPlaneClient, moved: Callable[[Dict[int, float]], bool], period_s: float) -> float:
    """Frames from now until a datagram fulfils `moved`, by the simulator's own time in them (index 0)."""
    first = None
    while True:
        datagram = client.wait(5.0)
        if datagram is None:
            raise HarnessError("the emulator fell silent")
        values = dict(protocol.decode_rref_response(datagram))
        if 0 not in values:
            continue
        first = values[0] if first is None else first
        if moved(values):
            return (values[0] - first) / period_s
        if values[0] - first > 2.0:
            raise HarnessError(f"nothing moved within 2 s of a command: {values}")


@benchmark
def command_to_surface(context: Context) -> List[Measure]:
    """A command on control/auto until the aileron moves, in simulator frames; 0: in the first frame after it."""
    frames: List[float] = []
    shown: List[float] = []
    period = 1.0 / 60.0
    with _Field(context, 60.0) as field, EmulatorProcess(context.folder, ["--fps", "60"]) as emulator:
        field.port = emulator.port
        field.launch("tx.launch")
        field.master.use_here()
        import rospy
        from xplane_bridge.msg import AppliedCommand, ControlCommand
        from xplane_bridge.srv import SetMode

        rospy.init_node("bench_command", anonymous=True, disable_signals=True)
        publisher = rospy.Publisher("/bench/control/auto", ControlCommand, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber(
            "/bench/control/applied",
            AppliedCommand,
            lambda applied: shown.append(applied.read_back_frames) if applied.read_back else None,
            tcp_nodelay=True,
        )
        rospy.wait_for_service("/bench/tx_node/set_mode", 60.0)
        wait_until(lambda: rospy.ServiceProxy("/bench/tx_node/set_mode", SetMode)(mode=2).success, 60.0, "AUTO mode")
        client = XPlaneClient(emulator.port)
        client.subscribe(["sim/time/total_running_time_sec", _AILERON], rate_hz=100)
        command = ControlCommand(fields=ControlCommand.ROLL)

        def taken_over() -> bool:
            publisher.publish(command)
            return bool(shown)

        wait_until(taken_over, 30.0, "command of control/auto shown by X-Plane")
        for turn in range(max(10, round(context.seconds * 1.5))):
            # Well away from where it was, and held until the surface has come to rest.
            command.roll = 0.4 if turn % 2 == 0 else -0.4
            command.sequence += 1
            client.received()
            resting = dict(protocol.decode_rref_response(client.wait() or b""))[1]
            publisher.publish(command)
            took = _frames_until(client, lambda values, rest=resting: abs(values.get(1, rest) - rest) > 0.2, period)
            frames.append(took)
            for _ in range(30):
                client.wait()
                publisher.publish(command)
        client.close()
        rospy.signal_shutdown("measured")
    frames.sort()
    shown.sort()
    if not shown:
        raise HarnessError("control/applied never showed a read-back")
    return [
        Measure("command to moving aileron, median", frames[len(frames) // 2], "frames"),
        Measure("command to moving aileron, longest", frames[-1], "frames"),
        Measure("command to stick read back, median", shown[len(shown) // 2], "frames"),
    ]
