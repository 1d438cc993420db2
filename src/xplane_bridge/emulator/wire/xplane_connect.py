"""NASA's X-Plane Connect plugin, as far as the bridge asks it: position in doubles, and the terrain below."""

from __future__ import annotations

import logging
import math
import socket
import struct
from typing import Callable, Optional

from xplane_bridge import protocol
from xplane_bridge.emulator.wire.server import PortInUseError

_LOG = logging.getLogger(__name__)

_GETP = struct.Struct("<5sB")
_POSI = struct.Struct("<5sB3d4f")
_GETT = struct.Struct("<5sB3d")
_TERR = struct.Struct("<5sB3d6f2i")
#: In a GETT: the aircraft's own place. The plugin's -998 is not X-Plane's -999.
_OWN_PLACE = -998.0
_UP = (0.0, 1.0, 0.0)
_GEAR_HANDLE, _GEAR = "sim/cockpit2/controls/gear_handle_down", "sim/flightmodel2/gear/deploy_ratio"


class XPlaneConnect:
    """Answers GETP with POSI and GETT with TERR, once a frame, as the plugin does from its flight loop.

    Args:
        bind: Address to listen on.
        port: UDP port; 0 for a free one.
        position: Gives the aircraft's position in the frame.
        ground: Gives the height of the ground, which is level [m above mean sea level].
        value: Gives a dataref's value in the frame.
    """

    def __init__(
        self,
        bind: str,
        port: int,
        position: Callable[[], protocol.RposResponse],
        ground: Callable[[], float],
        value: Callable[[str], float],
    ) -> None:
        self._position = position
        self._ground = ground
        self._value = value
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind((bind, port))
        except OSError as error:
            self._socket.close()
            raise PortInUseError(error.errno, f"UDP port {port} of X-Plane Connect on {bind} cannot be bound") from None
        #: The port it listens on.
        self.port = self._socket.getsockname()[1]

    def answer(self) -> None:
        """Answers all that has been asked; what it does not know is ignored."""
        while True:
            try:
                datagram, sender = self._socket.recvfrom(protocol.MAX_DATAGRAM)
            except (BlockingIOError, InterruptedError):
                return
            except ConnectionRefusedError:  # an ICMP answer to something sent to a client that is gone
                continue
            reply = self._reply(datagram)
            if reply is None:
                _LOG.debug("X-Plane Connect ignored %r of %d bytes", datagram[:4], len(datagram))
            else:
                self._socket.sendto(reply, sender)

    def _reply(self, datagram: bytes) -> Optional[bytes]:
        here = self._position()
        if datagram[:4] == b"GETP" and len(datagram) == _GETP.size:
            return _POSI.pack(
                b"POSI\0",
                int(self._value(_GEAR_HANDLE) != 0.0),  # where the aircraft's number should be: the plugin's own bug
                here.latitude_deg,
                here.longitude_deg,
                here.elevation_m,
                here.pitch_deg,
                here.roll_deg,
                here.heading_deg,
                self._value(_GEAR),
            )
        if datagram[:4] == b"GETT" and len(datagram) == _GETT.size:
            _, aircraft, latitude, longitude, altitude = _GETT.unpack(datagram)
            if _OWN_PLACE in (latitude, longitude, altitude):
                latitude, longitude = here.latitude_deg, here.longitude_deg
            if not (math.isfinite(latitude) and math.isfinite(longitude)):
                return None
            still = (0.0, 0.0, 0.0)
            return _TERR.pack(b"TERR\0", aircraft, latitude, longitude, self._ground(), *_UP, *still, 0, 0)
        return None

    def close(self) -> None:
        """Closes it."""
        self._socket.close()
