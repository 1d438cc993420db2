"""UDP in captured packets: through Ethernet, Linux's cooked headers, loopback's, and plain IP."""

from __future__ import annotations

import socket
import struct
from typing import NamedTuple, Optional, Tuple

from xplane_bridge.wire_log.capture import CaptureError

Address = Tuple[str, int]

#: Link types of tcpdump and Wireshark that are understood.
ETHERNET, LINUX_COOKED, LINUX_COOKED_2, NULL, LOOP, RAW, IPV4, USER0 = 1, 113, 276, 0, 108, 101, 228, 147
#: Link types under which some systems write plain IP.
_RAW_TYPES = (RAW, IPV4, 12, 14)
_IPV4_TYPE, _VLAN_TYPES = 0x0800, (0x8100, 0x88A8)
_UDP = 17
_AF_INET = 2


class Datagram(NamedTuple):
    """A UDP datagram over IPv4."""

    source: Address
    destination: Address
    payload: bytes


class UdpPacket(NamedTuple):
    """What an IPv4 packet holds of a UDP datagram: all of it, or one fragment."""

    source: str
    destination: str
    number: int  #: the same in all fragments of a datagram
    offset: int  #: [bytes] in the datagram's body
    more: bool  #: fragments follow
    body: bytes  #: the header of UDP and the payload, or a part of them
    whole: bool  #: the capture has all of the packet


def datagram_in(link_type: int, data: bytes) -> Optional[Datagram]:
    """The datagram in a captured packet; None when it holds another protocol, or only a fragment.

    Args:
        link_type: as in the file's head (LINKTYPE_...).
        data: of the packet.

    Raises:
        CaptureError: The link type is not understood.
    """
    packet = udp_packet_in(link_type, data)
    return None if packet is None or packet.offset or packet.more else datagram_of(packet, packet.body)


def udp_packet_in(link_type: int, data: bytes) -> Optional[UdpPacket]:
    """The packet of UDP over IPv4 in a captured packet; None when it holds another protocol.

    Raises:
        CaptureError: The link type is not understood.
    """
    ip = _ip_in(link_type, data)
    if ip is None or len(ip) < 20 or ip[0] >> 4 != 4 or ip[9] != _UDP:
        return None
    head = (ip[0] & 15) * 4
    total, number, fragment = struct.unpack_from(">HHH", ip, 2)
    if head < 20:
        return None
    # Where the network card divides datagrams, the length says 0.
    body = ip[head : min(len(ip), total or len(ip))]
    return UdpPacket(
        socket.inet_ntoa(ip[12:16]),
        socket.inet_ntoa(ip[16:20]),
        number,
        (fragment & 0x1FFF) * 8,
        bool(fragment & 0x2000),
        bytes(body),
        len(ip) >= total,
    )


def datagram_of(packet: UdpPacket, body: bytes) -> Optional[Datagram]:
    """The datagram of a packet and its body; None when that is too short for one."""
    if len(body) < 8:
        return None
    from_port, to_port, size = struct.unpack_from(">HHH", body)
    payload = body[8:size] if size else body[8:]
    return Datagram((packet.source, from_port), (packet.destination, to_port), payload)


def _ip_in(link_type: int, data: bytes) -> Optional[bytes]:
    if link_type in _RAW_TYPES:
        return data
    if link_type == ETHERNET:
        return _after_type(data, 12)
    if link_type == LINUX_COOKED:
        return _after_type(data, 14)
    if link_type == LINUX_COOKED_2:
        return data[20:] if data[:2] == struct.pack(">H", _IPV4_TYPE) else None
    if link_type in (NULL, LOOP):
        # The family's byte order is that of the computer that captured; of Windows and BSD IPv4 is 2.
        return data[4:] if _AF_INET in struct.unpack("<I", data[:4]) + struct.unpack(">I", data[:4]) else None
    msg = (
        f"packets of link type {link_type} are not understood; expected Ethernet (1), Linux cooked (113, 276), "
        "null or loopback (0, 108) or raw IP (101, 228): capture on another interface, or convert the file with editcap"
    )
    raise CaptureError(msg)


def _after_type(data: bytes, at: int) -> Optional[bytes]:
    """What follows an Ethernet type at `at`, behind tags of virtual networks."""
    while len(data) >= at + 2:
        kind = struct.unpack_from(">H", data, at)[0]
        if kind == _IPV4_TYPE:
            return data[at + 2 :]
        if kind not in _VLAN_TYPES:
            return None
        at += 4
    return None
