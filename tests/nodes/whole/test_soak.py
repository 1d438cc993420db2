"""The soak of the full run, for a minute."""

from __future__ import annotations

import re
import subprocess
import sys

from support.room_table import ROOT

SOAK = ROOT / "tests/full/soak.py"


def test_a_minute_of_much_happening_loses_no_frame_and_no_memory():
    done = subprocess.run([sys.executable, SOAK, "--hours", "0.02"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert re.search(r"^4320 frames, 1\.2 min: none lost; \d flights begun anew, 3 aircraft", done.stdout, re.MULTILINE)
    assert "Traceback" not in done.stderr


def test_no_time_at_all_is_refused():
    done = subprocess.run([sys.executable, SOAK, "--hours", "0"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "--hours 0: expected more than 0" in done.stderr
