"""Ctrl-C for what tests start."""

from __future__ import annotations

import signal


def heed_ctrl_c() -> None:
    """Shells ignore SIGINT for what they run in the background, and programs would inherit that from here."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
