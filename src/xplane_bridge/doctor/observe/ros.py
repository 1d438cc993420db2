"""Asks the ROS master and looks at the names that this computer gives the others; XML-RPC only, no ROS."""

from __future__ import annotations

import contextlib
import http.client
import socket
import threading
import urllib.parse
import xmlrpc.client
from dataclasses import dataclass, field, replace
from typing import Any, Dict, List, Mapping, Set, Tuple

from xplane_bridge.doctor.observe.computer import is_own
from xplane_bridge.topics import absolute

_CALLER = "/xplane_doctor"
_TIMEOUT_S = 2.0
#: So many nodes of the namespace are called on.
_MOST_NODES = 12


@dataclass(frozen=True)
class Node:
    """A node of the bridge.

    Attributes:
        name: e.g. `/xplane/rx_node`.
        uri: Where it says it can be reached.
        error: Why it cannot be reached there; empty when it can.
    """

    name: str
    uri: str
    error: str = ""


@dataclass(frozen=True)
class RosFacts:
    """How ROS is set up here.

    Attributes:
        uri: ROS_MASTER_URI; empty where it is not set.
        malformed: Whether `uri` is not of the form http://HOST:PORT.
        host: Its host.
        port: Its port.
        address: Its host's IPv4 address; empty where the name is not known here.
        here: Whether that is this computer.
        answered: Whether a master answers there.
        refused: Whether that computer said that nothing listens on the port.
        error: Why no master answers, in the system's words.
        parameters: Those of the namespace.
        nodes: Those of the namespace.
        ip: ROS_IP; empty where it is not set.
        hostname: ROS_HOSTNAME; empty where it is not set.
        hostname_address: IPv4 address of `hostname`, or of this computer's name where neither is set; empty where the
            name is not known.
    """

    uri: str = ""
    malformed: bool = False
    host: str = ""
    port: int = 0
    address: str = ""
    here: bool = False
    answered: bool = False
    refused: bool = False
    error: str = ""
    parameters: Dict[str, Any] = field(default_factory=dict)
    nodes: Tuple[Node, ...] = ()
    ip: str = ""
    hostname: str = ""
    hostname_address: str = ""


class _Transport(xmlrpc.client.Transport):
    """XML-RPC that does not wait for ever."""

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = _TIMEOUT_S
        return connection


def observe(environment: Mapping[str, str], namespace: str) -> RosFacts:
    """Looks at ROS's environment variables and calls on the master they name.

    Args:
        environment: ROS_MASTER_URI, ROS_IP, ROS_HOSTNAME.
        namespace: Of the bridge, e.g. `/xplane`.
    """
    facts = RosFacts(
        uri=environment.get("ROS_MASTER_URI", ""),
        ip=environment.get("ROS_IP", ""),
        hostname=environment.get("ROS_HOSTNAME", ""),
    )
    facts = replace(facts, hostname_address=_address(facts.hostname or socket.gethostname()))
    if not facts.uri:
        return facts
    try:
        parts = urllib.parse.urlsplit(facts.uri)
        host, port = parts.hostname, parts.port
    except ValueError:  # a port that is no number
        host, port = None, None
    if host is None or port is None or parts.scheme != "http":
        return replace(facts, malformed=True)
    address = _address(host)
    facts = replace(facts, host=host, port=port, address=address, here=bool(address) and is_own(address))
    if not address:
        return replace(facts, error=f"the name {host} is not known on this computer")
    return _call_master(facts, absolute(namespace).rstrip("/"))


def _call_master(facts: RosFacts, namespace: str) -> RosFacts:
    try:
        with xmlrpc.client.ServerProxy(facts.uri, transport=_Transport()) as master:
            master.getPid(_CALLER)
            answer: Any = master.getParam(_CALLER, namespace)
            code, _, parameters = answer
            found = parameters if code == 1 and isinstance(parameters, dict) else {}
            answer = master.getSystemState(_CALLER)
            _, _, (publishers, subscribers, services) = answer
            names: Set[str] = {
                name for group in (publishers, subscribers, services) for _, nodes in group for name in nodes
            }
            ours = sorted(name for name in names if name.startswith(namespace + "/"))[:_MOST_NODES]
            uris = []
            for name in ours:
                answer = master.lookupNode(_CALLER, name)
                uris.append((name, str(answer[2])))
    except ConnectionRefusedError as error:
        return replace(facts, refused=True, error=error.strerror or str(error))
    except socket.timeout:
        return replace(facts, error=f"no answer within {_TIMEOUT_S:g} s")
    except OSError as error:
        return replace(facts, error=error.strerror or str(error))
    except (xmlrpc.client.Error, http.client.HTTPException, ValueError, TypeError, IndexError) as error:
        return replace(facts, error=f"what answers is no ROS master ({type(error).__name__})")
    return replace(facts, answered=True, parameters=found, nodes=_reached(uris))


def _reached(uris: List[Tuple[str, str]]) -> Tuple[Node, ...]:
    """Tries, all at once, whether nodes can be reached where they say."""
    nodes: Dict[str, Node] = {}

    def reach(name: str, uri: str) -> None:
        nodes[name] = Node(name, uri, _why_unreachable(uri))

    threads = [threading.Thread(target=reach, args=each, daemon=True) for each in uris]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(2 * _TIMEOUT_S)
    return tuple(nodes.get(name, Node(name, uri, "its name is being looked up for too long")) for name, uri in uris)


def _why_unreachable(uri: str) -> str:
    """Why nothing can be reached at a node's URI; empty when it can."""
    try:
        parts = urllib.parse.urlsplit(uri)
        if not parts.hostname or not parts.port:
            return f"{uri!r} is no address"
        with socket.create_connection((parts.hostname, parts.port), _TIMEOUT_S):
            return ""
    except socket.gaierror:
        return "its name is not known on this computer"
    except socket.timeout:
        return f"no answer within {_TIMEOUT_S:g} s"
    except (OSError, ValueError) as error:
        return getattr(error, "strerror", None) or str(error)


def _address(name: str) -> str:
    with contextlib.suppress(OSError, UnicodeError):
        return socket.gethostbyname(name)
    return ""
