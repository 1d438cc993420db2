#!/usr/bin/env python3
"""Makes a fuzz target's seeds: make_corpus.py SEEDS CORPUS. Packets in hex become bytes, other files stay as they are.

Beside packets, files that only describe them (.json) are left out.
"""

import sys
from pathlib import Path


def main():
    source, corpus = Path(sys.argv[1]), Path(sys.argv[2])
    corpus.mkdir(parents=True, exist_ok=True)
    packets = sorted(source.glob("*.hex"))
    for packet in packets:
        (corpus / packet.stem).write_bytes(bytes.fromhex(packet.read_text()))
    if not packets:
        for file in sorted(source.iterdir()):
            (corpus / file.name).write_bytes(file.read_bytes())


if __name__ == "__main__":
    main()
