#!/usr/bin/env python3
"""Carries out the Containerfile in a bare root file system where there is no container engine: root and debootstrap do.

    sudo tests/container/container_steps.py /tmp/root --then "scripts/demo --duration 20 --headless"

A new root of the release that FROM names is made, each step is carried out in it, and in the end the command, if one is
given, in the image's working directory.
"""

from __future__ import annotations

import argparse
import fnmatch
import os
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Iterator, List, Optional, Sequence

ROOT = Path(__file__).resolve().parents[2]
RELEASES = {"debian:12": "bookworm"}
#: Files of this machine that an engine gives every container, in its own way: names of computers, localhost among them.
OF_ENGINE = (Path("/etc/resolv.conf"), Path("/etc/hosts"))
#: Seen by a command in the root; nothing else of this machine's environment is.
PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"


@dataclass(frozen=True)
class Step:
    """A line of the file: RUN and what to run."""

    instruction: str
    words: str


def steps(text: str) -> List[Step]:
    """The steps of a Containerfile.

    Raises:
        ValueError: An instruction that this program does not carry out.
    """
    lines = [line for line in text.replace("\\\n", " ").splitlines() if line.strip() and not line.startswith("#")]
    found = [Step(*line.split(None, 1)) for line in lines]
    for step in found:
        if step.instruction not in ("FROM", "RUN", "COPY", "WORKDIR", "CMD"):
            raise ValueError(f"{step.instruction} {step.words}: this program does not know {step.instruction}")
        if step.instruction == "FROM" and step.words not in RELEASES:
            raise ValueError(f"FROM {step.words}: this program makes {', '.join(RELEASES)} only")
        if step.instruction == "COPY" and step.words.split()[:-1] != ["."]:
            raise ValueError(f"COPY {step.words}: this program copies the whole folder only (COPY . PLACE)")
    if not found or found[0].instruction != "FROM":
        raise ValueError("the first step is not FROM")
    return found


def ignored(text: str) -> List[str]:
    """The patterns of a .containerignore."""
    return [line.strip() for line in text.splitlines() if line.strip() and not line.startswith("#")]


class BareRoot:
    """A root file system that steps are carried out in.

    Args:
        folder: Of the root; must be empty or not there.
        from_here: Files and folders of this machine that commands see at the same place.
    """

    def __init__(self, folder: Path, from_here: Sequence[Path]) -> None:
        self.folder = folder
        self.from_here = from_here
        self.place = "/"

    def carry_out(self, step: Step, source: Path, leave_out: Sequence[str]) -> None:
        """One step; `source` is the folder that COPY copies, without what `leave_out` matches at its top."""
        if step.instruction == "FROM":
            subprocess.run(["debootstrap", "--variant=minbase", RELEASES[step.words], str(self.folder)], check=True)
        elif step.instruction == "WORKDIR":
            self.place = step.words
        elif step.instruction == "COPY":
            self._copy(source, step.words.split()[-1], leave_out)
        elif step.instruction == "RUN":
            self.run(["sh", "-c", step.words])

    def run(self, command: Sequence[str]) -> None:
        """A command in the root and its working directory."""
        inside = f"cd {shlex.quote(self.place)} && exec {shlex.join(command)}"
        lines = [*self._mounts(), shlex.join(["exec", "chroot", str(self.folder), "sh", "-c", inside])]
        environment = {"PATH": PATH, "HOME": "/root", "LC_ALL": "C.UTF-8", "DEBIAN_FRONTEND": "noninteractive"}
        # Mounted for this command alone: what is unmounted in there stays mounted here, and nothing is left behind.
        alone = ["unshare", "--mount", "--propagation", "private", "sh", "-e", "-c", "\n".join(lines)]
        subprocess.run(alone, env=environment, check=True)

    def _mounts(self) -> Iterator[str]:
        """The shell's lines that mount what a command needs of this machine."""
        yield shlex.join(["mount", "-t", "proc", "proc", str(self.folder / "proc")])
        yield shlex.join(["mount", "--rbind", "/dev", str(self.folder / "dev")])
        for path in self.from_here:
            target = self.folder / path.relative_to("/")
            (target if path.is_dir() else target.parent).mkdir(parents=True, exist_ok=True)
            if not path.is_dir():
                target.touch()
            yield shlex.join(["mount", "--bind", str(path), str(target)])
            # A package's set-up must not write to this machine.
            yield shlex.join(["mount", "-o", "remount,bind,ro", str(target)])

    def _copy(self, source: Path, place: str, leave_out: Sequence[str]) -> None:
        def at_top(folder: str, names: List[str]) -> List[str]:
            if Path(folder) != source:
                return []
            return [name for name in names if any(fnmatch.fnmatch(name, pattern) for pattern in leave_out)]

        shutil.copytree(source, self.folder / place.lstrip("/"), symlinks=True, ignore=at_top, dirs_exist_ok=True)


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """The program; see the module's text."""
    parser = argparse.ArgumentParser(
        description="Carries out the Containerfile in a bare root file system.",
        epilog="Name servers and hosts are this machine's. Behind a proxy with a certificate of its own, e.g.: "
        "--from-here /usr/local/share/ca-certificates --from-here /etc/pip.conf",
    )
    parser.add_argument("folder", type=Path, help="of the new root; must be empty or not there")
    parser.add_argument(
        "--from-here", type=Path, action="append", default=[], metavar="PATH", help="seen in the root at the same place"
    )
    parser.add_argument("--then", type=shlex.split, default=[], metavar="COMMAND", help="run in the root at the end")
    options = parser.parse_args(arguments)
    if options.folder.exists() and any(options.folder.iterdir()):
        parser.error(f"{options.folder} is not empty: give the folder of a new root")
    if os.geteuid() != 0 or not shutil.which("debootstrap"):
        parser.error("needs root and debootstrap (apt-get install debootstrap)")
    root = BareRoot(options.folder, [*OF_ENGINE, *options.from_here])
    leave_out = ignored((ROOT / ".containerignore").read_text(encoding="utf-8"))
    try:
        for step in steps((ROOT / "Containerfile").read_text(encoding="utf-8")):
            print(f"=== {step.instruction} {step.words}", flush=True)
            root.carry_out(step, ROOT, leave_out)
        if options.then:
            print(f"=== {shlex.join(options.then)}", flush=True)
            root.run(options.then)
    except subprocess.CalledProcessError as error:
        print(f"container_steps: ended with {error.returncode}: {error.cmd}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
