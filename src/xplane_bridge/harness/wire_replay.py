"""A node that plays a recording of its wire under a ROS master of its own, and what it publishes in a bag."""

from __future__ import annotations

import shutil
import struct
import threading
import xmlrpc.client
from pathlib import Path
from types import MappingProxyType
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Tuple, Union

from xplane_bridge.harness.processes import HarnessError, ManagedProcess, wait_until
from xplane_bridge.harness.ros import RosMaster
from xplane_bridge.resources import node_program

_WAITS, _START = "wire_replay_waits", "wire_replay_start"
_PUBLISHED, _RECEIVED = "wire_replay_published", "wire_replay_received"
_CALLER = "/wire_replay"
_READY_S = 60.0
#: Of ROS itself; they say nothing of the recording.
_NOT_RECORDED = ("/rosout", "/rosout_agg", "/diagnostics")
_STAMP = struct.Struct("<III")


class Start(NamedTuple):
    """How the node is started."""

    program: str  #: rx_node, tx_node
    node: str  #: full name
    namespace: str  #: of its topics
    shared: Mapping[str, Any]  #: parameters of the namespace
    own: Mapping[str, Any]  #: parameters of the node
    files: Mapping[str, bytes] = MappingProxyType({})  #: that the node finds in its folder of the user


class Message(NamedTuple):
    """One message as it came."""

    topic: str
    time_ns: int  #: [ns] its stamp, or that of the newest before it
    data: bytes


class WireReplay:
    """Plays records to a node. Use once.

    Args:
        start: the node.
        records: file of records (`xplane_bridge.wire_log.records`).
        folder: of logs, and of what ROS keeps.
        wire_log: file of a wire log of the replay itself; None: none.
    """

    def __init__(self, start: Start, records: Path, folder: Path, wire_log: Optional[Path] = None) -> None:
        self._start = start
        self._records = records
        self._folder = folder
        self._wire_log = wire_log
        self._lock = threading.Lock()
        self._time_ns = 0
        self._counts: Dict[str, int] = {}
        self._headers: Dict[str, Dict[str, str]] = {}
        #: In the order in which they came; within a topic that of publishing.
        self.messages: List[Message] = []

    def run(self, timeout: float) -> str:
        """Plays all of it; returns what the node says of it.

        Args:
            timeout: [s] after which it is given up.

        Raises:
            HarnessError: The node failed, or messages were lost.
        """
        master = RosMaster(self._folder)
        with master:
            master.use_here()
            import rospy

            rospy.init_node(_CALLER.strip("/"), anonymous=True, disable_signals=True)
            try:
                return self._play(master, timeout)
            finally:
                rospy.signal_shutdown("the replay is over")

    def _play(self, master: RosMaster, timeout: float) -> str:
        start = self._start
        base = start.namespace.rstrip("/")
        for key, value in start.shared.items():
            master.set_param(f"{base}/{key}", value)
        folder = master.ros_home / "xplane_bridge"
        shutil.rmtree(folder, ignore_errors=True)  # what an earlier replay has left
        for file, content in start.files.items():
            path = folder / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        own = {**start.own, "wire_replay": str(self._records.resolve())}
        for key, value in own.items():
            master.set_param(f"{start.node}/{key}", value)
        if self._wire_log is not None:
            master.set_param(f"{base}/wire_log", str(self._wire_log.resolve()))
        name = start.node.rsplit("/", 1)[1]
        command: List[Union[str, Path]] = [
            node_program(start.program, master.env),
            f"__ns:={start.namespace}",
            f"__name:={name}",
        ]
        with ManagedProcess(name, command, self._folder, env=master.env) as node:
            subscribers = self._subscribe(master, node)
            master.set_param(f"{start.node}/{_START}", True)

            def published() -> Any:
                node.check_running()
                return self._param(master, _PUBLISHED)

            try:
                so_far = f"it is at {self._time_ns / 1e9:.1f} s since 1970"
                report = wait_until(published, timeout, f"end of the replay; {so_far}")
                wait_until(lambda: self._has_all(master), timeout, "delivery of all that was published")
            except HarnessError as error:
                raise HarnessError(node.describe(str(error))) from None
            master.set_param(f"{start.node}/{_RECEIVED}", True)
            wait_until(lambda: not node.running, _READY_S, f"end of {name}")
            for subscriber in subscribers:
                subscriber.unregister()
            if node.returncode != 0:
                raise HarnessError(node.describe(f"ended with status {node.returncode}"))
            return str(report)

    def _subscribe(self, master: RosMaster, node: ManagedProcess) -> List[Any]:
        import rospy

        def published() -> List[Tuple[str, str]]:
            node.check_running()
            # By then the node has advertised everything: looked at before the topics are.
            if not self._param(master, _WAITS):
                return []
            with xmlrpc.client.ServerProxy(master.uri) as api:
                state: Any = api.getSystemState(_CALLER)
                types: Any = api.getTopicTypes(_CALLER)
            kinds = dict(types[2])
            ours = [topic for topic, nodes in state[2][0] if self._start.node in nodes]
            return [(topic, kinds[topic]) for topic in ours if topic not in _NOT_RECORDED]

        topics = wait_until(published, _READY_S, f"topic of {self._start.node}")
        subscribers = []
        for topic, _ in topics:
            subscribers.append(rospy.Subscriber(topic, rospy.AnyMsg, self._take, topic, tcp_nodelay=True))

        def connected() -> bool:
            # As the node has it: rospy counts a connection that it has only begun to make.
            sent = self._sent(master)
            return all(topic in sent for topic, _ in topics)

        wait_until(connected, _READY_S, "connection to all topics")
        return subscribers

    def _take(self, message: Any, topic: str) -> None:
        header = message._connection_header
        data = message._buff
        with self._lock:
            self._headers.setdefault(topic, header)
            if _has_header(header) and len(data) >= _STAMP.size:
                _, seconds, nanoseconds = _STAMP.unpack_from(data)
                self._time_ns = max(self._time_ns, seconds * 1_000_000_000 + nanoseconds)
            self.messages.append(Message(topic, self._time_ns, data))
            self._counts[topic] = self._counts.get(topic, 0) + 1

    def _has_all(self, master: RosMaster) -> bool:
        """Whether as much has come on each topic as the node says it has sent here."""
        sent = self._sent(master)
        with self._lock:
            return all(self._counts.get(topic, 0) >= count for topic, count in sent.items())

    def _sent(self, master: RosMaster) -> Dict[str, int]:
        """How many messages the node says it has sent, of each topic that has a subscriber."""
        with xmlrpc.client.ServerProxy(master.uri) as api:
            where: Any = api.lookupNode(_CALLER, self._start.node)
        with xmlrpc.client.ServerProxy(where[2]) as slave:
            stats: Any = slave.getBusStats(_CALLER)
        # roscpp answers without the status code and its text.
        published: Any = stats[2][0] if isinstance(stats[0], int) else stats[0]
        return {topic: max(row[3] for row in rows) for topic, rows in published if rows and topic not in _NOT_RECORDED}

    def _param(self, master: RosMaster, key: str) -> Any:
        with xmlrpc.client.ServerProxy(master.uri) as api:
            answer: Any = api.getParam(_CALLER, f"{self._start.node}/{key}")
        return answer[2] if answer[0] == 1 else None

    def write_bag(self, path: Path) -> None:
        """Writes what came as a ROS 1 bag."""
        from rosbags.rosbag1 import Writer

        with Writer(path) as writer:
            connections = {}
            for topic, header in sorted(self._headers.items()):
                connections[topic] = writer.add_connection(
                    topic,
                    header["type"].replace("/", "/msg/"),
                    msgdef=header["message_definition"],
                    md5sum=header["md5sum"],
                    callerid=header.get("callerid"),
                    latching=int(header.get("latching", "0")),
                )
            for message in self.messages:
                writer.write(connections[message.topic], message.time_ns, message.data)


def _has_header(connection: Mapping[str, str]) -> bool:
    for line in connection["message_definition"].splitlines():
        words = line.split("#")[0].split()
        if words and "=" not in line.split("#")[0]:
            return words[0] in ("Header", "std_msgs/Header")
    return False
