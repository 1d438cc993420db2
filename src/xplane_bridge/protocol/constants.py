"""Numbers of X-Plane's UDP protocol that both directions share."""

from __future__ import annotations

#: Port X-Plane listens on; the beacon announces the real one.
DEFAULT_PORT = 49000
#: Port X-Plane's own sending socket is bound to (source port of DATA). A client on the same machine must not use it.
DATA_SOURCE_PORT = 49001
#: The port most users give as the Data Output target.
DATA_TARGET_PORT = 49003
BEACON_GROUP = "239.255.1.1"
BEACON_PORT = 49707
#: RakNet multiplayer port, announced in beacons of minor version 2 and newer.
RAKNET_PORT = 49010

#: Letters plus the fifth byte, which differs by direction and by X-Plane version (receivers must not compare it).
HEADER_SIZE = 5

#: Fifth byte of what X-Plane 11 and 12 send, by label.
FIFTH_BYTE = {
    b"DATA": 0x2A,
    b"DREF": 0x2B,
    b"RREF": 0x2C,
    b"RPOS": 0x34,
    b"RADR": 0x35,
    b"BECN": 0x00,
}

#: Value of a DATA slot that the row does not use; sent in by a client it means "do not touch" / "give back".
UNUSED_SLOT = -999.0
SLOTS_PER_ROW = 8
ROW_SIZE = 4 + 4 * SLOTS_PER_ROW
#: Rows 0..138 exist in X-Plane 11 and 12.
ROW_COUNT = 139

RREF_REQUEST_SIZE = 413
RREF_PATH_SIZE = 400
RREF_PAIR_SIZE = 8
#: 5 + 183 * 8 = 1469 bytes: the most pairs that X-Plane puts into one RREF datagram.
RREF_MAX_PAIRS = 183
DREF_SIZE = 509
DREF_PATH_SIZE = 500
RPOS_RESPONSE_SIZE = 69
VEHX_SIZE = 45
PREL_SIZE = 69
ACFN_SIZE = 165
ACPR_SIZE = 229
SIMO_SIZE = 161
ISE4_SIZE = 37
RESE_SIZE = 5

#: ISE4 index of the Data Output target.
DATA_OUTPUT_TARGET = 64

#: Longest UDP payload over IPv4; a full DATA packet has 5009 bytes, so nothing shorter is a safe receive buffer.
MAX_DATAGRAM = 65507
