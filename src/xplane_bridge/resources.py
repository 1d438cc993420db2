"""Finds the files that lie outside the Python package: configuration, scenarios, launch files, programs."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Mapping, Optional

from xplane_bridge.errors import XplaneBridgeError

_PACKAGE = Path(__file__).resolve().parent


class ResourceError(XplaneBridgeError):
    """A file that belongs to the package is not there; the text says where it was looked for."""


def clone_dir() -> Optional[Path]:
    """The root of the source tree this package is used from; None when it is used from an installation."""
    root = _PACKAGE.parents[1]
    return root if (root / "package.xml").is_file() else None


def share_dir() -> Path:
    """The folder that holds config/ and, with ROS, launch/.

    That is the source tree, or share/xplane_bridge of the prefix that catkin or pip has installed to.

    Raises:
        ResourceError: There is no such folder.
    """
    clone = clone_dir()
    if clone is not None:
        return clone
    prefixes = [*_PACKAGE.parents, Path(sys.prefix), Path("/usr/local")]
    candidates = [prefix / "share" / "xplane_bridge" for prefix in prefixes]
    for candidate in candidates:
        if (candidate / "config").is_dir():
            return candidate
    looked = ", ".join(str(candidate) for candidate in candidates)
    msg = f"xplane_bridge's config/ was not found; looked in {looked}"
    raise ResourceError(msg)


def config_file(*parts: str) -> Path:
    """The path of a file below config/, e.g. ``config_file("scenarios", "demo.yaml")``.

    Raises:
        ResourceError: There is no such file; the text lists what the folder holds.
    """
    path = share_dir().joinpath("config", *parts)
    if not path.is_file():
        there = sorted(p.name for p in path.parent.glob("*" + path.suffix)) if path.parent.is_dir() else []
        msg = f"{path} does not exist; {path.parent} has: {', '.join(there) or 'nothing of that kind'}"
        raise ResourceError(msg)
    return path


def program(name: str) -> Path:
    """The path of one of the package's Python programs, e.g. ``program("xplane_emulator")``.

    Raises:
        ResourceError: There is no such program.
    """
    clone = clone_dir()
    folders = [clone / "scripts"] if clone else []
    folders += [prefix / "lib" / "xplane_bridge" for prefix in _PACKAGE.parents]
    folders += [Path(sys.prefix) / "bin", Path(sys.executable).parent]
    for folder in folders:
        if os.access(folder / name, os.X_OK):
            return folder / name
    looked = ", ".join(str(folder) for folder in folders)
    msg = f"the program {name} was not found; looked in {looked}"
    raise ResourceError(msg)


def node_program(name: str, env: Mapping[str, str]) -> Path:
    """The path of one of the package's compiled programs, e.g. ``node_program("rx_node", os.environ)``.

    Args:
        name: of the program.
        env: an environment with a ROS workspace in it.

    Raises:
        ResourceError: It is in none of the workspace's folders.
    """
    prefixes = [prefix for prefix in env.get("CMAKE_PREFIX_PATH", "").split(os.pathsep) if prefix]
    for prefix in prefixes:
        path = Path(prefix) / "lib" / "xplane_bridge" / name
        if os.access(path, os.X_OK):
            return path
    looked = ", ".join(prefixes) or "nothing"
    msg = f"{name} is not built, or the setup.bash of its workspace is not sourced; looked in {looked}"
    raise ResourceError(msg)
