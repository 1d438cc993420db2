"""This computer: its system, addresses, gateway and firewall."""

from __future__ import annotations

import contextlib
import ipaddress
import platform
import re
import socket
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Tuple


@dataclass(frozen=True)
class Computer:
    """This computer.

    Attributes:
        system: `Linux`, `Darwin` or `Windows`.
        name: Host name.
        wsl: Whether Linux runs inside Windows (WSL).
        addresses: Its IPv4 addresses, the loopback's left out.
        gateway: IPv4 address of the default gateway (in WSL2 with NAT: Windows); empty where unknown.
        firewall: Name of a firewall that is known to be switched on; empty otherwise.
    """

    system: str = "Linux"
    name: str = ""
    wsl: bool = False
    addresses: Tuple[str, ...] = ()
    gateway: str = ""
    firewall: str = ""


def observe(proc: Path = Path("/proc"), etc: Path = Path("/etc")) -> Computer:
    """Looks at this computer."""
    return Computer(
        system=platform.system(),
        name=socket.gethostname(),
        wsl="microsoft" in _text(proc / "version").lower(),
        addresses=_addresses(proc),
        gateway=_gateway(proc),
        firewall="ufw" if re.search(r"^ENABLED=yes\b", _text(etc / "ufw" / "ufw.conf"), re.MULTILINE) else "",
    )


def is_own(address: str) -> bool:
    """Whether an IPv4 address is one of this computer's: only those can be bound."""
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((address, 0))
        return True
    return False


def is_same_computer(a: str, b: str) -> bool:
    """Whether two IPv4 addresses are known to be of one computer."""
    return a == b or (is_own(a) and is_own(b))


def is_loopback(address: str) -> bool:
    """Whether an IPv4 address reaches only the computer it is used on; False for what is no address."""
    with contextlib.suppress(ValueError):
        return ipaddress.IPv4Address(address).is_loopback
    return False


def _addresses(proc: Path) -> Tuple[str, ...]:
    table = _text(proc / "net" / "fib_trie")
    if table:
        found = re.findall(r"\|-- (\S+)\n\s*/32 host LOCAL", table)
    else:
        found = []
        with contextlib.suppress(OSError):
            found = socket.gethostbyname_ex(socket.gethostname())[2]
    return tuple(address for address in dict.fromkeys(found) if not is_loopback(address))


def _gateway(proc: Path) -> str:
    for line in _text(proc / "net" / "route").splitlines()[1:]:
        fields = line.split()
        if len(fields) > 2 and fields[1] == "00000000" and fields[2] != "00000000":
            return socket.inet_ntoa(struct.pack("=I", int(fields[2], 16)))
    return ""


def _text(path: Path) -> str:
    """What a file holds; empty when it cannot be read."""
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
