"""Gymnasium environments that fly as the bridge flies (docs/experiments/gym.md).

Importing this registers `xplane_bridge/FixedWing-v0`, `xplane_bridge/Multirotor-v0` and `xplane_bridge/Tiltrotor-v0`.
"""

from __future__ import annotations

try:
    import gymnasium
except ImportError as error:
    raise ImportError(f"xplane_bridge.gym needs gymnasium: pip install 'gymnasium>=1.1' ({error})") from None

from xplane_bridge.gym.env import FlyEnv
from xplane_bridge.gym.tasks import Hover, Task, WingsLevel
from xplane_bridge.gym.vector import FlyVectorEnv

__all__ = ["FlyEnv", "FlyVectorEnv", "Hover", "Task", "WingsLevel"]

_AIRCRAFT = {"FixedWing": "fixed_wing", "Multirotor": "multirotor", "Tiltrotor": "tiltrotor"}

for _name, _aircraft in _AIRCRAFT.items():
    gymnasium.register(
        f"xplane_bridge/{_name}-v0",
        entry_point="xplane_bridge.gym.env:FlyEnv",
        vector_entry_point="xplane_bridge.gym.vector:FlyVectorEnv",
        kwargs={"aircraft": _aircraft},
    )
