"""The C++ table of X-Plane's failure names, written from the lists of X-Plane's names.

`python tests/support/simulator/failure_name_lines.py > lib/core/failures/failure_name_lines.cpp` writes it anew.
"""

from __future__ import annotations

import sys
import textwrap
from pathlib import Path
from typing import Dict, List, Optional, Tuple

ROOT = Path(__file__).resolve().parents[3]
FILE = ROOT / "lib/core/failures/failure_name_lines.cpp"
PREFIX = "sim/operation/failures/rel_"

#: First internal version that has something, and the first that has it no more (None: the newest has it).
Range = Tuple[int, Optional[int]]

_HEAD = """\
// Written from src/xplane_bridge/xplane_names/datarefs.txt by tests/support/simulator/failure_name_lines.py:
// do not edit.

#include "xplane_bridge/core/failures/failure_names.hpp"

namespace xplane_bridge::core {

// clang-format off
const std::vector<FailureNames>& failureNameTable() {
  static const std::vector<FailureNames> table = {
"""
_FOOT = """\
  };
  return table;
}
// clang-format on

}  // namespace xplane_bridge::core
"""


def ranges(present: List[bool], firsts: List[int]) -> List[Range]:
    """When a name is there, from whether each list has it; the oldest list also holds for all before it."""
    found: List[Range] = []
    for here, first in zip(present, [0, *firsts[1:]]):
        running = bool(found) and found[-1][1] is None
        if here and not running:
            found.append((first, None))
        elif not here and running:
            found[-1] = (found[-1][0], first)
    return found


def rendered() -> str:
    """The file's text."""
    sys.path.insert(0, str(ROOT / "src"))
    from xplane_bridge import xplane_names

    firsts = [xplane_names.first_version(version) for version in xplane_names.VERSIONS]
    lists = [xplane_names.datarefs(version) for version in xplane_names.VERSIONS]
    table: Dict[Range, List[str]] = {}
    for name in sorted({name for facts in lists for name in facts if name.startswith(PREFIX)}):
        for versions in ranges([name in facts for facts in lists], firsts):
            table.setdefault(versions, []).append(name[len(PREFIX) :])
    text = _HEAD
    for (first, end), leaves in sorted(table.items(), key=lambda row: (row[0][0], row[0][1] or sys.maxsize)):
        lines = textwrap.wrap(" ".join(leaves), 104)
        literal = "\n".join(f'         "{line} "' for line in lines[:-1]) + f'\n         "{lines[-1]}"'
        text += f"      {{{{{first}, {'VersionRange{}.end' if end is None else end}}},\n{literal.lstrip(chr(10))}}},\n"
    return text + _FOOT


if __name__ == "__main__":
    sys.stdout.write(rendered())
