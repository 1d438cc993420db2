"""Connections between publishers and the subscribers of tests."""

from __future__ import annotations

from typing import Any


def is_connected(subscriber: Any) -> bool:
    """Whether a publisher has answered a rospy.Subscriber; rospy counts connections that it has only begun to make."""
    connections = list(subscriber.impl.connections)
    return bool(connections) and all(connection.md5sum for connection in connections)
