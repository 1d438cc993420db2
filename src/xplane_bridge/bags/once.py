"""Warnings about recordings."""

from __future__ import annotations

import functools
import logging

_LOG = logging.getLogger(__name__)


@functools.lru_cache(maxsize=None)
def warn_once(text: str) -> None:
    """Say it on stderr, unless the program has set up logging; once, however often it is found out."""
    _LOG.warning("%s", text)
