"""Writes what follows from the messages: C++ structs, field table, conversions to ROS, and the Python constants.

A field of a message is written in two places: in msg/ (type, unit, range, frame) and in lib/core/state/sources.txt
(dataref, row, wire unit). Enumerations, bits and kinds come from the constants and comments of msg/ and srv/.

    python3 cmake/message_code core INCLUDE             headers of xplane_bridge_core
    python3 cmake/message_code nodes INCLUDE SOURCES    headers and sources of xplane_bridge_nodes
    python3 cmake/message_code python                   src/xplane_bridge/constants.py, held up to date by a test
    python3 cmake/message_code migration                migration/*.bmr and bags/later_fields.py, likewise

Python 3.8 and its standard library: this runs before anything is installed.
"""

import sys
from pathlib import Path
from typing import Dict, List

import cpp_base
import cpp_control
import cpp_state
import migration
from definitions import ROOT, MessageError, read_sources
from kinds import check_repetitions
from python_constants import python_file

CORE, MESSAGES = "xplane_bridge/core", "xplane_bridge/nodes/messages"
CONSTANTS = ROOT / "src" / "xplane_bridge" / "constants.py"


def _write(folder: Path, files: Dict[str, str]) -> None:
    for name, text in files.items():
        path = folder / name
        if path.is_file() and path.read_text(encoding="utf-8") == text:
            continue  # its time stays: whatever includes it need not be compiled again
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def main(arguments: List[str]) -> int:
    """Does what the arguments ask for; 1 with one line on stderr where the messages do not fit together."""
    try:
        sources = read_sources()
        check_repetitions()
        if arguments[:1] == ["core"] and len(arguments) == 2:
            _write(Path(arguments[1]), cpp_state.state_headers(sources))
            _write(Path(arguments[1]), {f"{CORE}/base/message_constants.hpp": cpp_base.constants()})
            _write(Path(arguments[1]), {f"{CORE}/control/control_fields.hpp": cpp_control.control_fields()})
        elif arguments[:1] == ["nodes"] and len(arguments) == 3:
            _write(Path(arguments[1]), {f"{MESSAGES}/state_messages.hpp": cpp_state.state_messages_header(sources)})
            _write(Path(arguments[1]), {f"{MESSAGES}/control_scalars.hpp": cpp_control.control_scalars()})
            _write(Path(arguments[2]), {"state_messages.cpp": cpp_state.state_messages_source(sources)})
        elif arguments == ["migration"]:
            migration.write()
        elif arguments == ["python"]:
            CONSTANTS.write_text(python_file(sources), encoding="utf-8")
        else:
            print(__doc__, file=sys.stderr)
            return 2
    except MessageError as error:
        print(f"message_code: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
