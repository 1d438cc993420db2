"""Which programs of this computer hold a UDP port."""

from __future__ import annotations

import contextlib
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, Iterable, List, Set


@dataclass(frozen=True)
class Holder:
    """A program that holds a port.

    Attributes:
        program: Its name; empty where it is another user's, whose processes the system does not show.
        pid: Its process number; 0 then.
    """

    program: str = ""
    pid: int = 0

    def __str__(self) -> str:
        """For people."""
        return f"{self.program} (process {self.pid})" if self.pid else "a program of another user"

    @property
    def is_xplane(self) -> bool:
        """Whether it is X-Plane, or the emulator that stands in for it."""
        return self.program.startswith("X-Plane") or self.program == "xplane_emulator"


def holders(ports: Iterable[int], proc: Path = Path("/proc")) -> Dict[int, List[Holder]]:
    """Who holds each of these UDP ports; nothing where no process does, or on systems without a /proc."""
    inodes: Dict[int, Set[str]] = {port: set() for port in ports}
    for table in ("udp", "udp6"):
        with contextlib.suppress(OSError):
            for line in (proc / "net" / table).read_text(encoding="ascii").splitlines()[1:]:
                fields = line.split()
                port = int(fields[1].rpartition(":")[2], 16)
                if port in inodes:
                    inodes[port].add(fields[9])
    owners = _owners({inode for group in inodes.values() for inode in group}, proc)
    found: Dict[int, List[Holder]] = {}
    for port, group in inodes.items():
        named = {owners.get(inode, Holder()) for inode in group}
        found[port] = sorted(named, key=lambda holder: holder.pid)
    return found


def program_name(pid: int, proc: Path = Path("/proc")) -> str:
    """The name of a process's program: that of the script where an interpreter runs one; empty where it is gone."""
    try:
        words = (proc / str(pid) / "cmdline").read_bytes().decode(errors="replace").split("\0")
    except OSError:
        return ""
    name = os.path.basename(words[0])
    if re.fullmatch(r"python[\d.]*", name):
        scripts = [word for word in words[1:] if word and not word.startswith("-")]
        return os.path.basename(scripts[0]) if scripts else name
    return name


def _owners(inodes: Set[str], proc: Path) -> Dict[str, Holder]:
    """The process of each socket, by the socket's inode."""
    found: Dict[str, Holder] = {}
    if not inodes:
        return found
    for folder in proc.iterdir():
        if not folder.name.isdigit():
            continue
        with contextlib.suppress(OSError):  # it has ended, or is another user's
            for link in os.scandir(folder / "fd"):
                with contextlib.suppress(OSError):
                    match = re.fullmatch(r"socket:\[(\d+)\]", os.readlink(link.path))
                    if match and match.group(1) in inodes:
                        pid = int(folder.name)
                        found[match.group(1)] = Holder(program_name(pid, proc), pid)
    return found
