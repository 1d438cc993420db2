"""Bags as a recorder leaves them that was killed."""

from __future__ import annotations

from pathlib import Path


def without_index(raw: bytes) -> bytes:
    """The content of a bag in which the place of the index is not written yet."""
    at = raw.index(b"index_pos=") + len(b"index_pos=")
    return raw[:at] + b"\0" * 8 + raw[at + 8 :]


def cut_off(bag: Path) -> Path:
    """Make of a whole bag what is left of it, under the name of while it was recorded."""
    bag.write_bytes(without_index(bag.read_bytes()))
    return bag.rename(bag.with_name(bag.name + ".active"))
