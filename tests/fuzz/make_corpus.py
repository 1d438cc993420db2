#!/usr/bin/env python3
"""Turns golden packets (hex text) into a libFuzzer seed corpus (binary): make_corpus.py PACKETS CORPUS."""

import sys
from pathlib import Path


def main():
    source, corpus = Path(sys.argv[1]), Path(sys.argv[2])
    corpus.mkdir(parents=True, exist_ok=True)
    for packet in sorted(source.glob("*.hex")):
        (corpus / packet.stem).write_bytes(bytes.fromhex(packet.read_text()))


if __name__ == "__main__":
    main()
