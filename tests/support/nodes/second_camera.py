"""The second window of the emulator (`--window2 down@90`) as a camera of its own."""

from __future__ import annotations

from typing import Any

from xplane_bridge.harness import ManagedProcess, roslaunch

#: Its name: the namespace below the bridge's.
NAME = "belly"
#: The emulator's option that draws it.
WINDOW = ("--window2", "down@90")


def second_camera(world: Any, port: int, display: str, **arguments: object) -> ManagedProcess:
    """camera.launch of that window, in a world's namespace; not started yet.

    Args:
        world: of the test.
        port: the emulator's.
        display: X display of its windows.
        **arguments: further ones of the launch file.
    """
    of_window = {"window_index": 1, "pitch": -90, "field_of_view": 90, "assumed_view": "down", "x_display": display}
    of_xplane = {"host": "127.0.0.1", "port": port, "listen_for_beacon": False}
    names = {"ns": world.namespace.lstrip("/"), "camera": NAME}
    every = {**names, **of_window, **of_xplane, **arguments}
    return roslaunch(world.master, world.folder, "camera.launch", **every)
