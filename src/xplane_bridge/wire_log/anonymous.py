"""A recording without addresses and names: for bug reports, and for captures that are kept as tests."""

from __future__ import annotations

import ipaddress
import re
import struct
import xmlrpc.client
from pathlib import Path
from typing import Any, Dict, Iterator, List, Match, Optional, Pattern, Sequence

from xplane_bridge.wire_log.capture import Capture, Interface, Packet, write_pcapng
from xplane_bridge.wire_log.datagrams import RAW, USER0, Datagram
from xplane_bridge.wire_log.fragments import DatagramReader
from xplane_bridge.wire_log.own_log import USER_FILE, about_of

_BEACON_NAME = 21  #: where the computer's name begins
_NAME = b"computer"
#: In texts, also within words such as 192.168.1.77_49000_conformance.yaml; and the zeros that fill a field.
_ADDRESS = re.compile(rb"(?<![0-9])((?:[0-9]{1,3}\.){3}[0-9]{1,3})(?![0-9])(\0*)")
#: Paths that do not begin with a slash: of a home, relative, of a URL, of Windows, of another computer (as scp has it),
#: and folders with a file that has an ending. A topic, a frame, a dataref and udp://... are none.
_PATH = re.compile(r"~|\.\.?[/\\]|file:|[^/\\]*:[/\\](?!/)|[^/]*\\|(?![^/]*://)[^\s]*/[^\s/]*\.[^\s/]*$")
#: A user's name behind ~ goes with the folders.
_SEPARATOR = re.compile(r"^~[^/\\]*|[/\\]")
#: Parameters for which nodes write _SECRET (kSecrets in lib/nodes/base/parameter_text.cpp); logs of version 0.2.0 and
#: before have them.
_SECRETS, _SECRET = ("token",), "..."
#: Fits wherever an address has stood.
_SHORTEST = b"0.0.0.0"


class Disguise:
    """Other addresses for those of a recording, the same for the same."""

    def __init__(self) -> None:
        self._addresses: Dict[str, str] = {}
        self._hosts: Dict[str, str] = {}
        self._host_in_text: Optional[Pattern[bytes]] = None

    def address(self, address: str) -> str:
        """What stands for an address; loopback, multicast, broadcast and the unspecified address keep theirs.

        Raises:
            ipaddress.AddressValueError: It is none.
        """
        return address if _stays(address) else self._stand_in(address)

    def knows(self, address: str) -> bool:
        """Whether an address was in what was read so far."""
        return address in self._addresses or _stays(address)

    def name(self, host: str, address: Optional[str]) -> None:
        """From now on a host's name is disguised as its address is.

        Args:
            host: as the user calls it.
            address: the host's; None: not known.
        """
        self._hosts[host.lower()] = self._stand_in(host) if address is None else self.address(address)
        names = b"|".join(re.escape(each.encode()) for each in self._hosts)
        # A computer may be called xplane; the node reads a file by words with that in them.
        self._host_in_text = re.compile(
            rb"(?<![A-Za-z0-9])(?:" + names + rb")(?![A-Za-z0-9]|_(?:bridge|version)\b)", re.IGNORECASE
        )

    def payload(self, data: bytes) -> bytes:
        """A datagram's content of the same length, its texts replaced."""
        if data.startswith(b"BECN\0") and len(data) > _BEACON_NAME:
            end = data.find(b"\0", _BEACON_NAME)
            size = (end if end >= 0 else len(data)) - _BEACON_NAME
            name = (_NAME * (size // len(_NAME) + 1))[:size]
            data = data[:_BEACON_NAME] + name + data[_BEACON_NAME + size :]
        return _ADDRESS.sub(self._in_its_field, data)

    def note(self, data: bytes) -> bytes:
        """An input; of a file, name and content may hold addresses, also of other computers."""
        name, zero, rest = data.partition(b"\0")
        return self._text(name) + zero + self._text(rest) if name.startswith(USER_FILE) else data

    def word(self, value: Any) -> Any:
        """A value that is an address or a host's name as a whole, disguised; any other as it is."""
        if not isinstance(value, str):
            return value
        if value.lower() in self._hosts:
            return self._hosts[value.lower()]
        try:
            return self.address(value)
        except ipaddress.AddressValueError:
            return value

    def value(self, value: Any) -> Any:
        """A parameter: addresses, hosts and secrets replaced, of paths the last part kept."""
        if isinstance(value, dict):
            return {key: _SECRET if key in _SECRETS and each != "" else self.value(each) for key, each in value.items()}
        if isinstance(value, list):
            return [self.value(each) for each in value]
        if not isinstance(value, str):
            return value
        word = self.word(value)
        if word != value:
            return word
        path = Path(value)
        has_folder = (path.is_absolute() and path.parent != Path("/")) or _PATH.match(value) is not None
        data = (_SEPARATOR.split(value.rstrip("/\\"))[-1] if has_folder else value).encode()
        # A topic, a frame or a dataref may hold the same word as the host's name; a file's name is the user's own.
        is_file = has_folder or path.suffix != ""
        return (self._text(data) if is_file else _ADDRESS.sub(self._in_text, data)).decode()

    def _stand_in(self, for_what: str) -> str:
        new = str(ipaddress.IPv4Address("10.0.0.0") + len(self._addresses) + 1)
        return self._addresses.setdefault(for_what, new)

    def _text(self, data: bytes) -> bytes:
        data = _ADDRESS.sub(self._in_text, data)
        if self._host_in_text is None:
            return data
        return self._host_in_text.sub(lambda found: self._hosts[found.group().decode().lower()].encode(), data)

    def _in_text(self, found: Match[bytes]) -> bytes:
        return self._of(found.group(1)) + found.group(2)

    def _in_its_field(self, found: Match[bytes]) -> bytes:
        room, new = len(found.group()), self._of(found.group(1))
        if len(new) > room:
            new = _SHORTEST
        return new.ljust(room, b"\0")

    def _of(self, text: bytes) -> bytes:
        numbers = [int(number) for number in text.split(b".")]
        return text if max(numbers) > 255 else self.address(".".join(map(str, numbers))).encode()


class Anonymiser:
    """All parts of a recording in one disguise.

    Args:
        parts: the files of a wire log in their order, or one capture of another program.

    Raises:
        CaptureError: One cannot be read.
    """

    def __init__(self, parts: Sequence[Path]) -> None:
        self.disguise = Disguise()
        self._left_out: List[str] = []
        self._interfaces: Dict[Path, List[Interface]] = {}
        self._abouts: Dict[Path, Optional[Dict[str, Any]]] = {}
        sent: Optional[str] = None
        for part in parts:
            capture = Capture.open(part)
            reader = DatagramReader()
            for packet in capture.packets():
                datagram = _datagram(reader, capture, packet)
                if datagram is None:
                    continue
                for address, _ in (datagram.source, datagram.destination):
                    self.disguise.address(address)
                if packet.outbound and sent is None:
                    sent = datagram.destination[0]
            reader.finish()
            self._interfaces[part] = list(capture.interfaces)
            self._note_what_is_left_out(part, capture, reader)
            self._abouts[part] = about_of(capture)
        for about in self._abouts.values():
            host = str((about or {}).get("shared", {}).get("host", ""))
            if host and not is_address(host):
                self.disguise.name(host, sent)

    def left_out(self) -> List[str]:
        """What of the recording is not in its disguise, in words."""
        return list(self._left_out)

    def blocks(self, part: Path) -> Iterator[bytes]:
        """A part as the blocks of a pcapng file: its UDP datagrams, and of a wire log all it has.

        Raises:
            CaptureError: It cannot be read any more.
        """
        about = self._abouts[part]
        comment = ""
        if about is not None:
            # Names of the node, of its topics and frames are not of the computer.
            names: Dict[str, Any] = {key: about[key] for key in ("node", "program", "namespace") if key in about}
            parameters: Dict[str, Any] = self.disguise.value(about)
            text = xmlrpc.client.dumps(({**parameters, **names},))
            comment = text[text.index("<value>") : text.rindex("</value>") + len("</value>")].replace("\n", "")
        interfaces = [
            (USER0 if i.link_type == USER0 else RAW, i.name if about else "", i.description if about else "")
            for i in self._interfaces[part]
        ]
        packets = self._packets(Capture.open(part), about is not None)
        return write_pcapng(interfaces, packets, comment, "xplane_bridge wire_replay --anonymise")

    def _packets(self, capture: Capture, own: bool) -> Iterator[Packet]:
        reader = DatagramReader()
        for packet in capture.packets():
            datagram = _datagram(reader, capture, packet)
            if datagram is not None:
                yield packet._replace(data=_raw(self.disguise, datagram), comment=packet.comment if own else "")
            elif own and capture.interfaces[packet.interface].link_type == USER0:
                yield packet._replace(data=self.disguise.note(packet.data))

    def _note_what_is_left_out(self, part: Path, capture: Capture, reader: DatagramReader) -> None:
        incomplete, cut = sum(reader.incomplete.values()), sum(reader.cut.values())
        if incomplete:
            self._left_out.append(
                f"{incomplete} datagrams of {part} are left out because fragments of them are missing"
            )
        if cut:
            self._left_out.append(f"{cut} datagrams of {part} are left out because the capture has cut them short")
        if capture.cut:
            self._left_out.append(f"{part} is cut off; all before that is kept")


def _datagram(reader: DatagramReader, capture: Capture, packet: Packet) -> Optional[Datagram]:
    link_type = capture.interfaces[packet.interface].link_type
    return None if link_type == USER0 else reader.read(link_type, packet)


def _stays(address: str) -> bool:
    ip = ipaddress.IPv4Address(address)
    return ip.is_loopback or ip.is_multicast or ip.is_unspecified or address == "255.255.255.255"


def is_address(text: str) -> bool:
    """Whether a text is an IPv4 address and nothing else."""
    try:
        ipaddress.IPv4Address(text)
    except ipaddress.AddressValueError:
        return False
    return True


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
