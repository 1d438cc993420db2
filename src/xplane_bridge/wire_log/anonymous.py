"""A recording without addresses and names: for bug reports, and for captures that are kept as tests."""

from __future__ import annotations

import ipaddress
import struct
import xmlrpc.client
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Tuple

from xplane_bridge.wire_log.capture import Capture, Packet, write_pcapng
from xplane_bridge.wire_log.datagrams import RAW, USER0, Datagram, datagram_in
from xplane_bridge.wire_log.own_log import USER_FILE, about_of

_BEACON_NAME = 21  #: where the computer's name begins
_NAME = b"computer"


class Disguise:
    """Other addresses for those of a recording, the same for the same."""

    def __init__(self) -> None:
        self._addresses: Dict[str, str] = {}

    def address(self, address: str) -> str:
        """What stands for an address; loopback, multicast, broadcast and the unspecified address keep theirs."""
        ip = ipaddress.IPv4Address(address)
        if ip.is_loopback or ip.is_multicast or ip.is_unspecified or address == "255.255.255.255":
            return address
        return self._addresses.setdefault(address, str(ipaddress.IPv4Address("10.0.0.0") + len(self._addresses) + 1))

    def payload(self, data: bytes) -> bytes:
        """A datagram's content of the same length, its texts replaced."""
        if data.startswith(b"BECN\0") and len(data) > _BEACON_NAME:
            end = data.find(b"\0", _BEACON_NAME)
            size = (end if end >= 0 else len(data)) - _BEACON_NAME
            name = (_NAME * (size // len(_NAME) + 1))[:size]
            data = data[:_BEACON_NAME] + name + data[_BEACON_NAME + size :]
        for old, new in list(self._addresses.items()):
            data = _replaced(data, old.encode(), new.encode())
        return data

    def note(self, data: bytes) -> bytes:
        """An input; a file's name may hold an address."""
        name, zero, rest = data.partition(b"\0")
        if not name.startswith(USER_FILE):
            return data
        for old, new in self._addresses.items():
            name = name.replace(old.encode(), new.encode())
        return name + zero + rest

    def value(self, value: Any, hosts: Dict[str, str]) -> Any:
        """A parameter: addresses and hosts replaced, of paths the last part kept."""
        if isinstance(value, dict):
            return {key: self.value(each, hosts) for key, each in value.items()}
        if isinstance(value, list):
            return [self.value(each, hosts) for each in value]
        if not isinstance(value, str):
            return value
        if value in hosts:
            return hosts[value]
        try:
            return self.address(value)
        except ipaddress.AddressValueError:
            pass
        return Path(value).name if value.startswith("/") and Path(value).parent != Path("/") else value


def _replaced(data: bytes, old: bytes, new: bytes) -> bytes:
    """`data` with a text replaced where the field has room for it."""
    at = data.find(old)
    while at >= 0:
        end = at + max(len(old), len(new))
        alone = not data[at + len(old) : at + len(old) + 1].isdigit()
        if alone and not data[at + len(old) : end].strip(b"\0"):
            data = data[:at] + new.ljust(end - at, b"\0") + data[end:]
        at = data.find(old, at + len(new))
    return data


def anonymised(path: Path) -> Iterator[bytes]:
    """The blocks of a pcapng file: the UDP datagrams of a recording, and of a wire log all it has, in disguise.

    Args:
        path: one file of a wire log, or a capture of another program.

    Raises:
        CaptureError: It cannot be read.
    """
    capture = Capture.open(path)
    seen: List[Tuple[Packet, int, Optional[Datagram]]] = []
    disguise = Disguise()
    for packet in capture.packets():
        link_type = capture.interfaces[packet.interface].link_type
        datagram = None if link_type == USER0 else datagram_in(link_type, packet.data)
        if datagram is not None:
            for address, _ in (datagram.source, datagram.destination):
                disguise.address(address)
        seen.append((packet, link_type, datagram))
    about = about_of(Capture.open(path))
    comment = ""
    interfaces = [
        (USER0 if i.link_type == USER0 else RAW, i.name if about else "", i.description if about else "")
        for i in capture.interfaces
    ]
    if about is not None:
        sent = next((d.destination[0] for p, _, d in seen if d is not None and p.outbound), None)
        host = str(about.get("shared", {}).get("host", ""))
        hosts = {host: disguise.address(sent)} if host and sent is not None else {}
        # Names of the node, of its topics and frames are not of the computer.
        names: Dict[str, Any] = {key: about[key] for key in ("node", "program", "namespace") if key in about}
        parameters: Dict[str, Any] = disguise.value(about, hosts)
        text = xmlrpc.client.dumps(({**parameters, **names},))
        comment = text[text.index("<value>") : text.rindex("</value>") + len("</value>")].replace("\n", "")

    def packets() -> Iterator[Packet]:
        for packet, link_type, datagram in seen:
            if datagram is not None:
                yield packet._replace(data=_raw(disguise, datagram), comment=packet.comment if about else "")
            elif link_type == USER0 and about is not None:
                yield packet._replace(data=disguise.note(packet.data))

    return write_pcapng(interfaces, packets(), comment, "xplane_bridge wire_replay --anonymise")


def _raw(disguise: Disguise, datagram: Datagram) -> bytes:
    payload = disguise.payload(datagram.payload)
    udp = struct.pack(">HHHH", datagram.source[1], datagram.destination[1], 8 + len(payload), 0) + payload
    head = struct.pack(">BBHHHBBH", 0x45, 0, 20 + len(udp), 0, 0, 64, 17, 0)
    ends = b"".join(
        ipaddress.IPv4Address(disguise.address(address)).packed
        for address, _ in (datagram.source, datagram.destination)
    )
    total = sum(struct.unpack(">10H", head + ends))
    while total > 0xFFFF:
        total = (total & 0xFFFF) + (total >> 16)
    return head[:10] + struct.pack(">H", ~total & 0xFFFF) + ends + udp
