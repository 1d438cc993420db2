"""clang-tidy on folders of lib, many files as one translation unit: common headers are read once.

Most of clang-tidy's time goes into Eigen, ROS and the standard library: a file of lib/core that is checked alone takes
four fifths of what all files of its room take together. Files that give different things one name are checked apart.
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
#: What an unnamed namespace declares: constants and types; functions, with their parameters.
_NAMES = re.compile(r"^(?!using )[A-Za-z][^\n(={;]*?\b(\w+)(?:\[[^]\n]*\])? ?[={;]", re.MULTILINE)
_CONSTANTS = re.compile(r"\b(k[A-Z]\w*)(?:\[[^]\n]*\])? = ")  # more of them may follow in one declaration
_FUNCTIONS = re.compile(r"^[A-Za-z][^\n(={;]*?\b(\w+)\(([^{;]*)\)", re.MULTILINE)
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
    houses = {folder for given_folder in given.folders for folder in _houses(_ROOT / given_folder)}
    if not houses:
        parser.error(f"no .cpp below {', '.join(given.folders)}")
    flags = _flags(_ROOT / given.build / "compile_commands.json")
    files = {house: sorted(house.rglob("*.cpp")) for house in sorted(houses)}
    rooms = sorted({file.parent for chosen in files.values() for file in chosen})
    missing = [str(room.relative_to(_ROOT)) for room in rooms if room not in flags]
    if missing:
        parser.error(f"not built, so clang-tidy does not know their include folders: {', '.join(missing)}")
    cache = _ROOT / given.cache
    cache.mkdir(parents=True, exist_ok=True)
    rules = _rules(_ROOT / given.build)
    units = []
    for house, chosen in files.items():
        words = tuple(dict.fromkeys(word for file in chosen for word in flags[file.parent]))
        changed = [file for file in chosen if not _mark(file, words, cache, rules).exists()]
        if len(changed) < len(chosen):
            print(f"{house.relative_to(_ROOT)}: {len(chosen) - len(changed)} files have not changed", flush=True)
        units += [Unit(house, part, words, cache, rules) for part in _apart(changed)]
    failed = False
    with ThreadPoolExecutor(os.cpu_count()) as workers:
        for unit, log in zip(units, workers.map(Unit.findings, units)):
            names = ", ".join(str(file.relative_to(unit.house)) for file in unit.files)
            print(f"{unit.house.relative_to(_ROOT)}: {names}: {'FAILED' if log else 'clean'}", flush=True)
            failed = failed or bool(log)
            sys.stdout.write(log)
    return int(failed)


class Unit:
    """Files of a house, lib/core for example, that are checked together."""

    def __init__(self, house: Path, files: List[Path], flags: Sequence[str], cache: Path, rules: bytes) -> None:
        self.house = house
        self.files = files
        self._flags = flags
        self._cache = cache
        self._rules = rules

    def findings(self) -> str:
        """What clang-tidy says; nothing where they are clean, which is then kept."""
        source = self._cache / f"{hashlib.sha256(str(self.files).encode()).hexdigest()}.cpp"
        source.write_text("".join(f'#include "{file}"  // NOLINT\n' for file in self.files), encoding="utf-8")
        command = ["clang-tidy", "--quiet", f"--config-file={_ROOT / '.clang-tidy'}"]
        command += [f"--header-filter={self.house}/|{_HEADERS}", str(source), "--", "-std=c++17", *self._flags]
        done = subprocess.run(command, check=False, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        source.unlink()
        # Names that _apart() does not see; or clang-tidy itself has crashed, which it does on some large units.
        if ("[clang-diagnostic-error" in done.stdout or done.returncode < 0) and len(self.files) > 1:
            half = len(self.files) // 2
            parts = (self.files[:half], self.files[half:])
            return "".join(Unit(self.house, part, self._flags, self._cache, self._rules).findings() for part in parts)
        if done.returncode:
            return done.stdout or f"clang-tidy ended with {done.returncode}\n"
        for file in self.files:
            _mark(file, self._flags, self._cache, self._rules).touch()
        return ""


def _mark(file: Path, flags: Sequence[str], cache: Path, rules: bytes) -> Path:
    """A file that is there when `file`, as it is now, has been found clean."""
    key = hashlib.sha256(rules + " ".join([*flags, str(file)]).encode() + file.read_bytes())
    return cache / key.hexdigest()


def _apart(files: Sequence[Path]) -> List[List[Path]]:
    """The files in as few lists as it takes to have nothing of an unnamed namespace twice in one."""
    lists: List[Tuple[List[Path], Set[str]]] = []
    for file in files:
        own = {name for body in _UNNAMED.findall(file.read_text(encoding="utf-8")) for name in _declared(body)}
        for chosen, names in lists:
            if not names & own:
                chosen.append(file)
                names |= own
                break
        else:
            lists.append(([file], own))
    return [chosen for chosen, _ in lists]


def _declared(body: str) -> Iterator[str]:
    """Names of constants and types; of functions with the types of their parameters, as overloads do no harm."""
    yield from _NAMES.findall(body)
    yield from _CONSTANTS.findall(body)
    for name, parameters in _FUNCTIONS.findall(body):
        yield f"{name}({', '.join(each.rpartition(' ')[0] for each in parameters.split(', '))})"


def _houses(folder: Path) -> Iterator[Path]:
    """The folders of lib itself that hold the sources below `folder`; `folder` where it is in one of them."""
    depth = len((_ROOT / "lib").parts) + 1
    for file in folder.rglob("*.cpp"):
        yield Path(*file.parts[: max(depth, len(folder.parts))])


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
