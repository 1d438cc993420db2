"""The compiled module `xplane_bridge._core`, where it has been built."""

from __future__ import annotations

import contextlib
import importlib
from typing import Any

from xplane_bridge.errors import XplaneBridgeError

core: Any = None  #: the module, or None
with contextlib.suppress(ImportError):
    core = importlib.import_module("xplane_bridge._core")


class NotCompiledError(XplaneBridgeError):
    """Something needs the compiled module, and it is not there."""


def require(who: str) -> Any:
    """The module, whole.

    Args:
        who: Needs it, for the message.

    Raises:
        NotCompiledError: It has not been built for this Python, or without what flights in process take.
    """
    if core is None or not hasattr(core, "flight_numbers"):
        missing = "is not there" if core is None else "was built without Eigen's headers"
        msg = (
            f"{who} flies with the bridge's own code, and the compiled module xplane_bridge._core {missing}: run "
            "scripts/setup in the clone, or pip install the package where a C++ compiler, python3-dev and "
            "libeigen3-dev are installed"
        )
        raise NotCompiledError(msg)
    return core
