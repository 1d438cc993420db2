"""clang-tidy on folders of lib, many files of a folder as one translation unit: common headers are read once.

Most of clang-tidy's time goes into Eigen, ROS and the standard library; together the files of a room take an eighth.
Files that give different things one name are checked in different units.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Dict, Iterator, List, Optional, Sequence, Set, Tuple

_ROOT = Path(__file__).resolve().parents[1]
_UNNAMED = re.compile(r"^namespace \{$(.*?)^\}  // namespace$", re.DOTALL | re.MULTILINE)
#: What an unnamed namespace declares: constants, types, functions.
_NAMES = re.compile(r"^[A-Za-z][^\n(={;]*?\b(\w+)(?:\[[^]\n]*\])? ?[({=;]", re.MULTILINE)
#: Rooms whose public headers are checked as well.
_HEADERS = r"/include/xplane_bridge/(core|actuation)/"


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Checks the folders; ends with 1 where there is a finding."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", help="below the clone, for example lib/core; with the folders in them")
    parser.add_argument(
        "--build", default=".workspace/build", help="folder of compile_commands.json (default %(default)s)"
    )
    parser.add_argument("--cache", default=".workspace/tidy", help="what was clean is kept here (default %(default)s)")
    given = parser.parse_args(argv)
    rooms = [room for folder in given.folders for room in _rooms(_ROOT / folder)]
    if not rooms:
        parser.error(f"no .cpp below {', '.join(given.folders)}")
    flags = _flags(_ROOT / given.build / "compile_commands.json")
    missing = [str(room.relative_to(_ROOT)) for room in rooms if room not in flags]
    if missing:
        parser.error(f"not built, so clang-tidy does not know their include folders: {', '.join(missing)}")
    cache = _ROOT / given.cache
    cache.mkdir(parents=True, exist_ok=True)
    rules = _rules(_ROOT / given.build)
    units = [Unit(files, flags[room], cache, rules) for room in rooms for files in _apart(sorted(room.glob("*.cpp")))]
    failed = False
    with ThreadPoolExecutor(os.cpu_count()) as workers:
        for unit, log in zip(units, workers.map(Unit.findings, units)):
            names = ", ".join(file.name for file in unit.files)
            print(f"{unit.files[0].parent.relative_to(_ROOT)}: {names}: {'FAILED' if log else 'clean'}", flush=True)
            failed = failed or bool(log)
            sys.stdout.write(log)
    return int(failed)


class Unit:
    """Files of a room that are checked together."""

    def __init__(self, files: List[Path], flags: Sequence[str], cache: Path, rules: bytes) -> None:
        self.files = files
        self._flags = flags
        self._cache = cache
        self._rules = rules

    def findings(self) -> str:
        """What clang-tidy says; nothing where they are clean, or were when it was last run."""
        room = self.files[0].parent
        content = b"".join(file.read_bytes() for file in [*self.files, *sorted(room.glob("*.hpp"))])
        key = hashlib.sha256(self._rules + " ".join([*self._flags, *map(str, self.files)]).encode() + content)
        clean = self._cache / key.hexdigest()
        if clean.exists():
            return ""
        source = self._cache / f"{key.hexdigest()}.cpp"
        source.write_text("".join(f'#include "{file}"  // NOLINT\n' for file in self.files), encoding="utf-8")
        command = ["clang-tidy", "--quiet", f"--config-file={_ROOT / '.clang-tidy'}"]
        command += [f"--header-filter={room}/|{_HEADERS}", str(source), "--", "-std=c++17", *self._flags]
        done = subprocess.run(command, check=False, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        source.unlink()
        # Names that _apart() does not see; or clang-tidy itself has crashed, which it does on some large units.
        if ("[clang-diagnostic-error" in done.stdout or done.returncode < 0) and len(self.files) > 1:
            half = len(self.files) // 2
            parts = (self.files[:half], self.files[half:])
            return "".join(Unit(part, self._flags, self._cache, self._rules).findings() for part in parts)
        if done.returncode:
            return done.stdout or f"clang-tidy ended with {done.returncode}\n"
        clean.touch()
        return ""


def _apart(files: Sequence[Path]) -> List[List[Path]]:
    """The files in as few lists as it takes to have no name of an unnamed namespace twice in one."""
    lists: List[Tuple[List[Path], Set[str]]] = []
    for file in files:
        own = {name for body in _UNNAMED.findall(file.read_text(encoding="utf-8")) for name in _NAMES.findall(body)}
        for chosen, names in lists:
            if not names & own:
                chosen.append(file)
                names |= own
                break
        else:
            lists.append(([file], own))
    return [chosen for chosen, _ in lists]


def _rooms(folder: Path) -> Iterator[Path]:
    return iter(sorted({file.parent for file in folder.rglob("*.cpp")}))


def _flags(database: Path) -> Dict[Path, Tuple[str, ...]]:
    """Include folders and definitions of the files of each folder."""
    found: Dict[Path, Dict[str, None]] = {}
    for entry in json.loads(database.read_text(encoding="utf-8")):
        words = shlex.split(entry["command"])
        chosen = found.setdefault(Path(entry["file"]).parent, {})
        for word, following in zip(words, [*words[1:], ""]):
            if word == "-isystem":
                chosen[f"-isystem{following}"] = None
            elif word.startswith(("-I", "-D")):
                chosen[word] = None
    return {folder: tuple(words) for folder, words in found.items()}


def _rules(build: Path) -> bytes:
    """What a room's outcome depends on besides its own files, generated headers included."""
    version = subprocess.run(["clang-tidy", "--version"], check=True, stdout=subprocess.PIPE).stdout
    folders = (_ROOT / "include", _ROOT / "lib", build.parent / "devel" / "include")
    headers = sorted(file for folder in folders for file in folder.rglob("*.hpp"))
    return b"".join([version, (_ROOT / ".clang-tidy").read_bytes(), *(file.read_bytes() for file in headers)])


if __name__ == "__main__":
    sys.exit(main())
