"""A ROS master of one's own, and roslaunch under it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import uuid
import xmlrpc.client
from pathlib import Path
from typing import Any, Dict, Mapping, NamedTuple, Optional, Set, Tuple

from xplane_bridge.harness.ports import free_tcp_port
from xplane_bridge.harness.processes import HarnessError, ManagedProcess, wait_until
from xplane_bridge.resources import clone_dir

_MASTER_TIMEOUT_S = 30.0
_CALLER = "/xplane_bridge_harness"
_NAMESPACE = "ROS_NAMESPACE"


def ros_environment(base: Optional[Mapping[str, str]] = None) -> dict[str, str]:
    """An environment in which ROS's programs find this package.

    Args:
        base: the environment to start from; this process's own when omitted.

    Returns:
        `base` when this package is in it (setup.bash has been sourced), else what scripts/setup has made in the clone;
        without ROS_NAMESPACE, below which nodes would be looked for in vain.

    Raises:
        HarnessError: There is neither.
    """
    env = dict(os.environ if base is None else base)
    env.pop(_NAMESPACE, None)
    if shutil.which("roslaunch", path=env.get("PATH")) and _knows_package(env):
        return env
    clone = clone_dir()
    file = clone / ".workspace" / "env.bash" if clone else None
    if file is None or not file.is_file():
        msg = "ROS does not know xplane_bridge here: source the setup.bash of its workspace" + (
            ", or run scripts/setup" if clone else ""
        )
        raise HarnessError(msg)
    script = 'source "$1" >/dev/null && env -0'
    done = subprocess.run(["bash", "-c", script, "bash", str(file)], env=env, stdout=subprocess.PIPE, check=False)
    if done.returncode != 0:
        msg = f"{file} cannot be sourced; run scripts/setup"
        raise HarnessError(msg)
    pairs = (entry.partition("=") for entry in done.stdout.decode().split("\0") if entry)
    return {key: value for key, _, value in pairs}


def _knows_package(env: Mapping[str, str]) -> bool:
    rospack = shutil.which("rospack", path=env.get("PATH"))
    if rospack is None:
        return False
    done = subprocess.run([rospack, "find", "xplane_bridge"], env=dict(env), capture_output=True, check=False)
    return done.returncode == 0


class Graph(NamedTuple):
    """Nodes and topics, by full names."""

    publishers: Dict[str, Set[str]]  #: topic to nodes
    subscribers: Dict[str, Set[str]]  #: topic to nodes
    connections: Set[Tuple[str, str, str]]  #: topic, publisher, subscriber

    def unconnected(self) -> Set[Tuple[str, str, str]]:
        """Topic, publisher and subscriber of the connections that are still to be made."""
        pairs = {
            (topic, publisher, subscriber)
            for topic, nodes in self.subscribers.items()
            for subscriber in nodes
            for publisher in self.publishers.get(topic, ())
        }
        return pairs - self.connections


class RosMaster(ManagedProcess):
    """A ROS master on a free port of the loopback interface; ready when ``with`` or `start` returns.

    It is what `roscore` starts, without roslaunch around it and without rosout, which the first roslaunch brings.

    Args:
        log_dir: folder of its log, of the nodes' logs, and of what else ROS keeps (ROS_HOME).
    """

    _ATTEMPTS = 5  # of finding a port that stays free meanwhile

    def __init__(self, log_dir: Path) -> None:
        #: ROS_HOME of this master and of all that runs under it; nodes start in this folder.
        self.ros_home = Path(log_dir).resolve() / "ros"
        self._base = ros_environment()
        #: ROS_MASTER_URI of this master; known after `start`.
        self.uri = ""
        super().__init__("rosmaster", [], log_dir)

    @property
    def env(self) -> dict[str, str]:
        """The environment of a program that is to use this master."""
        return {
            **self._base,
            "ROS_MASTER_URI": self.uri,
            "ROS_IP": "127.0.0.1",
            "ROS_HOSTNAME": "127.0.0.1",
            "ROS_HOME": str(self.ros_home),
            "ROS_LOG_DIR": str(self.ros_home / "log"),
            "PYTHONUNBUFFERED": "1",
        }

    def start(self) -> None:
        """Starts the master and waits until it answers.

        Raises:
            HarnessError: It does not come up.
        """
        self.ros_home.mkdir(parents=True, exist_ok=True)
        for attempt in range(self._ATTEMPTS):
            port = free_tcp_port()
            self.uri = f"http://127.0.0.1:{port}"
            self.command = ["rosmaster", "--core", "-p", str(port)]
            self._env = self.env
            super().start()
            try:
                wait_until(self._answers, _MASTER_TIMEOUT_S, "answer of the ROS master")
                self.set_param("/run_id", str(uuid.uuid1()))  # `roslaunch --wait` waits for it
                return
            except HarnessError:
                self.stop()
                if attempt == self._ATTEMPTS - 1:
                    raise

    def _answers(self) -> bool:
        self.check_running()
        try:
            with xmlrpc.client.ServerProxy(self.uri) as master:
                answer: Any = master.getPid(_CALLER)
        except (OSError, xmlrpc.client.Error):
            return False
        return bool(answer[0] == 1)

    def set_param(self, name: str, value: Any) -> None:
        """Sets a parameter by its full name."""
        with xmlrpc.client.ServerProxy(self.uri) as master:
            master.setParam(_CALLER, name, value)

    def end_node(self, node: str) -> None:
        """Asks a node to end, as rosnode does."""
        with xmlrpc.client.ServerProxy(self.uri) as master:
            answer: Any = master.lookupNode(_CALLER, node)
        with xmlrpc.client.ServerProxy(answer[2]) as api:
            api.shutdown(_CALLER, "the flight is over")

    def graph(self, namespace: str, *more: str) -> Graph:
        """Who publishes and who subscribes below a namespace, and who is connected, as all nodes say themselves.

        Args:
            namespace: full name.
            more: full names of further topics.
        """
        below = namespace.rstrip("/") + "/"
        with xmlrpc.client.ServerProxy(self.uri) as master:
            state: Any = master.getSystemState(_CALLER)
            publishers, subscribers = (
                {topic: set(nodes) for topic, nodes in each if topic.startswith(below) or topic in more}
                for each in state[2][:2]
            )
            found: Dict[str, Any] = {
                node: master.lookupNode(_CALLER, node) for node in set().union(*publishers.values())
            }
        connections = set()
        for node, answer in found.items():
            with xmlrpc.client.ServerProxy(answer[2]) as api:
                rows: Any = api.getBusInfo(_CALLER)
            connections |= {(row[4], node, row[1]) for row in rows[2] if row[2] == "o" and row[5]}
        return Graph(publishers, subscribers, connections)

    def use_here(self) -> None:
        """Makes this very process use the master: its environment, and rospy's once that is imported."""
        os.environ.update(self.env)
        os.environ.pop(_NAMESPACE, None)
        for folder in reversed(self.env.get("PYTHONPATH", "").split(os.pathsep)):
            if folder and folder not in sys.path:
                sys.path.insert(0, folder)


class MasterInUse:
    """The ROS master whose node this process is already."""

    @property
    def env(self) -> dict[str, str]:
        """The environment of a program that is to use this master."""
        return ros_environment()


def roslaunch(
    master: RosMaster | MasterInUse, log_dir: Path, launch_file: str, name: str = "roslaunch", **args: object
) -> ManagedProcess:
    """`roslaunch xplane_bridge <launch_file> key:=value ...` under a master; not started yet.

    Args:
        master: a running master.
        log_dir: folder of its log.
        launch_file: a file in launch/, e.g. "demo.launch".
        name: of the log, for programs that start several.
        **args: the launch file's arguments; booleans become true and false.
    """
    values = {key: str(value).lower() if isinstance(value, bool) else str(value) for key, value in args.items()}
    assignments = [f"{key}:={value}" for key, value in values.items()]
    return ManagedProcess(
        name, ["roslaunch", "--wait", "xplane_bridge", launch_file, *assignments], log_dir, env=master.env
    )
