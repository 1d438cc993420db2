"""Two computers and a cable between them, on one: network namespaces joined by a veth pair."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import tempfile
from pathlib import Path
from typing import Sequence

from xplane_bridge.harness.processes import HarnessError, ManagedProcess, wait_until
from xplane_bridge.harness.ros import ros_environment

_INTERFACE = "veth0"
_TIMEOUT_S = 30.0
# Root makes namespaces as it is; any other user as root of a user namespace, where the kernel lets users make those.
_ROOT = os.geteuid() == 0
_OWN_USER = () if _ROOT else ("--user", "--map-root-user")
_INTO_USER = () if _ROOT else ("--user", "--preserve-credentials")


class Machine:
    """One computer: its own network and all ports of it. Files, displays and the clock are the host's.

    Args:
        name: for logs.
        address: its IPv4 address on the cable.
        folder: of its logs and its ROS_HOME.
        beside: the other machine, when it exists already.
    """

    def __init__(self, name: str, address: str, folder: Path, beside: Machine | None = None) -> None:
        self.name = name
        self.address = address
        self.folder = Path(folder) / name
        make = ["unshare", *(() if beside else _OWN_USER), "--net", "sleep", "infinity"]
        self._holder = ManagedProcess("machine", [*beside.within(), *make] if beside else make, self.folder)

    @property
    def pid(self) -> int:
        """The process that keeps the namespace."""
        return self._holder.pid

    def start(self) -> None:
        """Switches it on.

        Raises:
            HarnessError: The computer does not permit it; the text says what it said.
        """
        self._holder.start()
        before = os.readlink("/proc/self/ns/net")

        def separated() -> bool:
            if not self._holder.running:
                raise HarnessError(self._holder.output().strip() or "the namespace could not be made")
            with contextlib.suppress(OSError):  # while the program is being replaced
                sleeps = Path(f"/proc/{self.pid}/comm").read_text(encoding="ascii").strip() == "sleep"
                return sleeps and self._network() != before
            return False

        wait_until(separated, _TIMEOUT_S, "network namespace")
        self.run("ip", "link", "set", "lo", "up")

    def within(self) -> list[str]:
        """What is put before a command so that it runs on this machine."""
        return ["nsenter", "--target", str(self.pid), *_INTO_USER, "--net"]

    def run(self, *command: str) -> None:
        """Runs a command on it to its end.

        Raises:
            HarnessError: It fails; the text is what it wrote.
        """
        done = subprocess.run(
            [*self.within(), *command],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
            timeout=_TIMEOUT_S,
        )
        if done.returncode != 0:
            msg = f"{' '.join(command)}: {done.stdout.decode(errors='replace').strip()}"
            raise HarnessError(msg)

    def environment(self, master: Machine) -> dict[str, str]:
        """That of programs on it, as users of ROS on several machines set it.

        Args:
            master: the machine that runs roscore.
        """
        env = ros_environment()
        env.pop("ROS_HOSTNAME", None)
        home = self.folder / "ros"
        return {
            **env,
            "ROS_MASTER_URI": f"http://{master.address}:11311",
            "ROS_IP": self.address,
            "ROS_HOME": str(home),
            "ROS_LOG_DIR": str(home / "log"),
            "PYTHONUNBUFFERED": "1",
        }

    def process(self, name: str, command: Sequence[str | Path], master: Machine) -> ManagedProcess:
        """A program on it, not started yet; its log is `<machine>/<name>.log`."""
        words = [*self.within(), *(str(word) for word in command)]
        return ManagedProcess(name, words, self.folder, env=self.environment(master))

    def plug(self, inserted: bool) -> None:
        """Plugs the cable in, or pulls it out."""
        self.run("ip", "link", "set", _INTERFACE, "up" if inserted else "down")
        if inserted:  # X-Plane's multicast beacon needs a route
            self.run("ip", "route", "replace", "default", "dev", _INTERFACE)

    def lose_power(self) -> None:
        """Kills all that runs on it at once. It can be used again afterwards."""
        network = self._network()

        def alive() -> list[int]:
            return [pid for pid in map(int, filter(str.isdigit, os.listdir("/proc"))) if self._holds(pid, network)]

        def none_left() -> bool:
            for pid in alive():
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            return not alive()

        wait_until(none_left, _TIMEOUT_S, f"end of all processes of {self.name}")

    def stop(self) -> None:
        """Kills what is left on it, and switches it off."""
        if self._holder.running:
            self.lose_power()
        self._holder.stop()

    def _holds(self, pid: int, network: str) -> bool:
        if pid == self.pid:
            return False
        try:
            return os.readlink(f"/proc/{pid}/ns/net") == network
        except OSError:  # it has ended, or is another user's
            return False

    def _network(self) -> str:
        return os.readlink(f"/proc/{self.pid}/ns/net")


class TwoMachines:
    """A computer for the simulator and one for the bridge, with a cable between them; ready within ``with``.

    Args:
        folder: of their logs.

    Attributes:
        simulator: that with X-Plane.
        bridge: the other one.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = Path(folder)
        self._stack = contextlib.ExitStack()
        self.simulator: Machine
        self.bridge: Machine

    def __enter__(self) -> TwoMachines:
        with contextlib.ExitStack() as stack:
            self.simulator = Machine("simulator", "10.77.0.1", self._folder)
            stack.callback(self.simulator.stop)
            self.simulator.start()
            self.bridge = Machine("bridge", "10.77.0.2", self._folder, beside=self.simulator)
            stack.callback(self.bridge.stop)
            self.bridge.start()
            peer = ["peer", "name", _INTERFACE, "netns", str(self.bridge.pid)]
            self.simulator.run("ip", "link", "add", _INTERFACE, "type", "veth", *peer)
            for machine in (self.simulator, self.bridge):
                machine.run("ip", "address", "add", f"{machine.address}/24", "dev", _INTERFACE)
                machine.plug(True)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()


def why_no_machines() -> str:
    """Why this computer does not let us have two, in words; empty where it does. Decided by trying."""
    for program in ("ip", "unshare", "nsenter"):
        if shutil.which(program) is None:
            return f"there is no program {program} (Debian: apt-get install iproute2 util-linux)"
    with tempfile.TemporaryDirectory() as folder:
        try:
            with TwoMachines(Path(folder)):
                return ""
        except HarnessError as error:
            return f"two network namespaces and a veth pair are not permitted here: {error}"
