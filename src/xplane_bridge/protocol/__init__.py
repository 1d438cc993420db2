"""X-Plane's UDP protocol: messages, their bytes, and the rows of the Data Output table.

Written from docs/protocol.md alone, independently of the C++ codec; both are held to the same golden packets.
"""

from xplane_bridge.protocol.constants import *  # noqa: F403
from xplane_bridge.protocol.fields import DecodeError
from xplane_bridge.protocol.requests import (
    AircraftLoad,
    AircraftLoadAndPlacement,
    CommandRequest,
    DataPacket,
    DrefWrite,
    NetworkTarget,
    Placement,
    RecoverAll,
    Request,
    RowSelection,
    RposRequest,
    RrefRequest,
    Situation,
    VehiclePose,
    decode_data,
    decode_request,
)
from xplane_bridge.protocol.responses import (
    Beacon,
    RposResponse,
    decode_beacon,
    decode_dref_response,
    decode_rpos_response,
    decode_rref_response,
    encode_rref_response,
)

__all__ = [
    "AircraftLoad",
    "AircraftLoadAndPlacement",
    "Beacon",
    "CommandRequest",
    "DataPacket",
    "DecodeError",
    "DrefWrite",
    "NetworkTarget",
    "Placement",
    "RecoverAll",
    "Request",
    "RowSelection",
    "RposRequest",
    "RposResponse",
    "RrefRequest",
    "Situation",
    "VehiclePose",
    "decode_beacon",
    "decode_data",
    "decode_dref_response",
    "decode_request",
    "decode_rpos_response",
    "decode_rref_response",
    "encode_rref_response",
]
