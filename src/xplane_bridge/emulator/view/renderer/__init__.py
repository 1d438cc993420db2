"""The emulator's cockpit view: drawn in software into a window titled like X-Plane's, in a process of its own.

The emulator's loop says what to draw (`Scene`), a `RendererProcess` takes it there and says when it is drawn. Each
picture carries a strip (`strip`) with its frame number and simulator time that programs can read back.
"""

from xplane_bridge.emulator.view.renderer.process import RendererError, RendererOptions, RendererProcess
from xplane_bridge.emulator.view.renderer.scene import Scene
from xplane_bridge.emulator.view.renderer.strip import StripError, StripReading, read_strip

__all__ = [
    "RendererError",
    "RendererOptions",
    "RendererProcess",
    "Scene",
    "StripError",
    "StripReading",
    "read_strip",
]
