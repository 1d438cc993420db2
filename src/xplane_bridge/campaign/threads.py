"""One thread for numpy's linear algebra: flights are the parallel part, and several threads' sums are other bits."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path
from typing import List

_LIBRARIES = ("OPENBLAS", "OMP", "MKL")
#: OpenBLAS's own function, by the names that numpy's and scipy's builds of it have.
_SETTERS = tuple(f"{first}openblas_set_num_threads{last}" for first in ("", "scipy_") for last in ("", "64_", "_64"))


def one_thread() -> None:
    """Holds what is loaded from now on to one thread, processes started from here too, and the OpenBLAS there is.

    A Dask worker has loaded numpy, which reads the environment then, before anything of this package runs in it.
    """
    for library in _LIBRARIES:
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    for path in loaded_openblas():
        openblas = ctypes.CDLL(path)
        for setter in _SETTERS:
            if hasattr(openblas, setter):
                getattr(openblas, setter)(1)


def loaded_openblas() -> List[str]:
    """Paths of the OpenBLAS libraries in this process; none where the system has no /proc."""
    try:
        lines = Path("/proc/self/maps").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return []
    paths = {line.split(maxsplit=5)[5] for line in lines if "openblas" in line}
    return sorted(path for path in paths if ".so" in Path(path).name)
