"""What to examine, and where things are looked for."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Mapping, Tuple

from xplane_bridge import protocol

#: Titles that X-Plane's window has: versions 11 and early 12, current 12.
WINDOW_TITLES = ("X-System", "X-Plane")


@dataclass(frozen=True)
class Settings:
    """What to examine, and where things are looked for.

    Attributes:
        host: X-Plane's computer, name or IPv4 address; empty: found as the nodes find it.
        port: The UDP port X-Plane listens on; 0: found as the nodes find it.
        namespace: Of the bridge's nodes and parameters.
        window_title: Part of the title of X-Plane's window; empty: one of `WINDOW_TITLES`, exactly.
        environment: Environment variables.
        beacon_group: Multicast group of X-Plane's beacon.
        beacon_port: UDP port of the beacon.
        listen_s: How long beacons are listened to [s]; X-Plane sends one a second.
        answer_s: How long X-Plane's answers are waited for [s].
        proc: Folder of Linux's process file system.
        etc: Folder of the system's configuration.
        devices: Folder of input devices.
    """

    host: str = ""
    port: int = 0
    namespace: str = "/xplane"
    window_title: str = ""
    environment: Mapping[str, str] = field(default_factory=lambda: dict(os.environ))
    beacon_group: str = protocol.BEACON_GROUP
    beacon_port: int = protocol.BEACON_PORT
    listen_s: float = 2.6
    answer_s: float = 3.0
    proc: Path = Path("/proc")
    etc: Path = Path("/etc")
    devices: Path = Path("/dev/input")

    @property
    def journal_folder(self) -> Path:
        """Where the bridge keeps its journals (docs/nodes/journal.md)."""
        ros_home = self.environment.get("ROS_HOME")
        return (Path(ros_home) if ros_home else Path.home() / ".ros") / "xplane_bridge"

    @property
    def window_titles(self) -> Tuple[str, ...]:
        """The titles that are looked for."""
        return (self.window_title,) if self.window_title else WINDOW_TITLES

    def is_wanted_title(self, title: str) -> bool:
        """Whether a window of this title is taken for X-Plane's."""
        return self.window_title in title if self.window_title else title in WINDOW_TITLES
