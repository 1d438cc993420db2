"""What a campaign is flown with: the same campaign with the same fingerprint is the same bits."""

from __future__ import annotations

import hashlib
import importlib
from functools import lru_cache
from pathlib import Path
from typing import Dict, Iterable, List

import numpy as np

from xplane_bridge import __version__
from xplane_bridge.campaign.definition import Campaign
from xplane_bridge.campaign.rows import cpu_kind
from xplane_bridge.compiled import require
from xplane_bridge.emulator.aircraft import model_names
from xplane_bridge.resources import config_file

CPU = "kind of CPU"
_PACKAGE = Path(__file__).resolve().parents[1]
#: How many Python files beside the controller's are looked at: its folder may be a home with anything in it.
_MOST_BESIDE = 256

Fingerprint = Dict[str, str]  #: by its name in messages


def fingerprint(campaign: Campaign) -> Fingerprint:
    """What the same bits depend on beside the campaign, in this process.

    Raises:
        CampaignError: There is no such controller.
        NotCompiledError: There is no compiled module.
    """
    compiled = Path(require("a campaign").__file__)
    plan, drawn = campaign.plan(0), campaign.document
    one_of = drawn.get("aircraft") or drawn["scenario"].get("aircraft")
    aircraft = model_names() if "$" in str(one_of) else (plan.aircraft,)
    files = [config_file(name) for name in ("rx.yaml", "tx.yaml")]
    files += [config_file("aircraft", f"{name}.yaml") for name in sorted(aircraft)]
    module = plan.controller.split(":")[0]
    return {
        CPU: cpu_kind(),
        "version of xplane_bridge": __version__,
        "code of xplane_bridge": _package_digest(_PACKAGE),
        "compiled module xplane_bridge._core": _file_digest(compiled),
        "configuration (config/rx.yaml, config/tx.yaml, config/aircraft)": _digest(files, files[0].parent),
        "code of the controller": _controller_digest(module) if module else "none",
        "jsbsim": importlib.import_module("jsbsim").__version__,
        "numpy": np.__version__,
    }


def differences(found: Fingerprint, wanted: Fingerprint) -> str:
    """What differs, in words: `jsbsim (1.2.2 instead of 1.3.0), ...`; empty when nothing does."""
    return ", ".join(
        f"{key} ({found.get(key, 'not noted')} instead of {value})"
        for key, value in wanted.items()
        if found.get(key) != value
    )


# Once a process: a Dask worker may outlive the files that it has imported, and flies what it has imported.
@lru_cache(maxsize=None)
def _package_digest(package: Path) -> str:
    """All Python sources of the package, and the models of its aircraft."""
    return _digest((path for path in package.rglob("*") if path.suffix in (".py", ".xml")), package)


@lru_cache(maxsize=None)
def _file_digest(path: Path) -> str:
    return _digest([path], path.parent)


@lru_cache(maxsize=None)
def _controller_digest(module: str) -> str:
    """The controller's module and the Python files beside it, the first `_MOST_BESIDE` by name; no folders below.

    What the controller takes from elsewhere is its own affair. A controller of the package is in the package's digest.
    """
    file = getattr(importlib.import_module(module), "__file__", None)
    if not file:
        return "built in"
    path = Path(file).resolve()
    if _PACKAGE in path.parents:
        return "of xplane_bridge"
    beside = sorted(other for other in path.parent.glob("*.py") if other.is_file())[:_MOST_BESIDE]
    return _digest({path, *beside}, path.parent)


def _digest(files: Iterable[Path], root: Path) -> str:
    digest = hashlib.sha256()
    named: List[str] = sorted(path.relative_to(root).as_posix() for path in files)
    for name in named:
        content = (root / name).read_bytes()
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()[:16]
