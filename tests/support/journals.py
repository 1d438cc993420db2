"""The panic tool and the journals it reads, as tests write them."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict, List

TOOL = Path(__file__).resolve().parents[2] / "scripts" / "release_overrides"
FOLDER = "sim/operation/override/"
STICK, THROTTLES = FOLDER + "override_joystick_roll", FOLDER + "override_throttles"
TIMEOUT_S = 300.0
#: The tool with six seconds for each dataref, not two: on a busy machine X-Plane's stand-in may be silent for longer.
PATIENT = TOOL.read_text("utf-8").replace("\nATTEMPTS = 5\n", "\nATTEMPTS = 15\n")
#: Nothing can be sent there: the system demands that broadcasts are asked for, and says so at once.
NO_WAY = "255.255.255.255"


def entry(id_: str, *undo: Dict[str, Any], **more: Any) -> Dict[str, Any]:
    owner = {"node": "/tx_node", "pid": 1, "start_ticks": 1, "boot_id": "b", "computer": socket.gethostname()}
    return {"id": id_, "purpose": "override", "owner": owner, "undo": list(undo), **more}


def override(path: str) -> Dict[str, Any]:
    return entry("override:" + path, {"op": "dref", "path": path, "value": 0.0})


def asked(id_: str, *ports: int) -> Dict[str, Any]:
    datarefs = [STICK, THROTTLES]
    return entry(id_, subscriptions=[{"port": port, "datarefs": datarefs, "rpos": False} for port in ports])


def write(file: Path, *entries: Any) -> Path:
    journal = {"format": "xplane_bridge journal", "version": 1, "entries": entries}
    file.write_text(json.dumps(journal), "utf-8")
    return file


def ids(file: Path) -> List[str]:
    return [each["id"] for each in json.loads(file.read_text("utf-8"))["entries"]]


def release(journal: Path, *more: str) -> subprocess.CompletedProcess[str]:
    assert "ATTEMPTS = 15" in PATIENT
    command = [sys.executable, "-c", PATIENT, "--folder", str(journal.parent), *more]
    return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
