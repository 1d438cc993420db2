"""Ports of the test harness: free, and not of those that other sockets get by chance."""

from __future__ import annotations

import itertools
import socket

import pytest

from xplane_bridge.harness import HarnessError, ports


@pytest.mark.parametrize(
    ("free_port", "kind"), [(ports.free_tcp_port, socket.SOCK_STREAM), (ports.free_udp_port, socket.SOCK_DGRAM)]
)
def test_a_port_is_free_and_not_of_those_given_away(monkeypatch, free_port, kind):
    with socket.socket(socket.AF_INET, kind) as taken, socket.socket(socket.AF_INET, kind) as given:
        first = free_port()
        taken.bind(("127.0.0.1", first))
        given.bind(("127.0.0.1", 0))
        assert first < given.getsockname()[1]
        drawn = itertools.count(first)  # others may have taken those that follow, too
        monkeypatch.setattr(ports.secrets, "randbelow", lambda _: next(drawn) - ports._FIRST)
        assert free_port() > first


def test_no_free_port_is_said(monkeypatch):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", ports.free_udp_port()))
        monkeypatch.setattr(ports.secrets, "randbelow", lambda _: taken.getsockname()[1] - ports._FIRST)
        with pytest.raises(HarnessError, match=f"no free port between {ports._FIRST} and {ports._END - 1}"):
            ports.free_udp_port()
