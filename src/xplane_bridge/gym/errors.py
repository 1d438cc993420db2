"""What is wrong with how an environment is made or used."""

from __future__ import annotations

from xplane_bridge.errors import XplaneBridgeError


class GymError(XplaneBridgeError, ValueError):
    """An environment was asked for what it does not have: what was given, what was expected."""
