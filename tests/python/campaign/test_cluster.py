"""A cluster of this machine's processes: Ctrl-C, which the terminal sends to all of them, and workers that are lost."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import yaml

from support.deadlines import PROGRAM_S
from support.process_tree import alive, descendants
from xplane_bridge.campaign.cluster import Cluster, local_cluster
from xplane_bridge.campaign.definition import parse_campaign

RUN = "import sys; from xplane_bridge.cli.run_campaign import main; sys.exit(main())"
#: Many flights of a tenth of a second.
CAMPAIGN = """
name: short
flights: 4000
scenario:
  name: short
  aircraft: fixed_wing
  start: {speed: 70, altitude: 1000}
  criteria: {level: {measure: maximum, of: roll, below: 90}}
  events: [{at: 0.1, end: true}]
"""


@pytest.mark.parametrize("to_all", [True, False])
def test_ctrl_c_ends_all_without_a_word_of_the_workers(tmp_path: Path, to_all: bool) -> None:
    pytest.importorskip("distributed")
    (tmp_path / "c.yaml").write_text(CAMPAIGN)
    command = [sys.executable, "-c", RUN, str(tmp_path / "c.yaml"), "--workers", "2", "-o", str(tmp_path / "c")]
    with (tmp_path / "log").open("wb") as log:
        program = subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True)
    deadline = time.monotonic() + PROGRAM_S
    try:
        while not list(tmp_path.glob("c/parts/*.parquet")):
            assert program.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.05)
        below = descendants(program.pid)
        assert len(below) >= 2
        (os.killpg if to_all else os.kill)(program.pid, signal.SIGINT)
        assert program.wait(PROGRAM_S) == 130
        while any(map(alive, below)):
            assert time.monotonic() < deadline
            time.sleep(0.05)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(program.pid, signal.SIGKILL)
    assert "Traceback" not in (tmp_path / "log").read_text()


def test_a_worker_that_was_started_anew_ignores_ctrl_c_too() -> None:
    pytest.importorskip("distributed")
    with local_cluster(1) as cluster:
        client = cluster._client
        (first,) = client.scheduler_info()["workers"]
        os.kill(cluster.worker_pids()[0], signal.SIGKILL)
        deadline = time.monotonic() + PROGRAM_S
        while set(client.scheduler_info()["workers"]) in (set(), {first}):
            assert time.monotonic() < deadline
            time.sleep(0.05)
        (handler,) = client.run(signal.getsignal, signal.SIGINT).values()
        assert handler == signal.SIG_IGN


@pytest.mark.parametrize(("replacements", "lost", "flown"), [(0, 1, False), (1, 1, True), (2, 2, False)])
def test_a_flight_whose_worker_was_replaced_is_flown_again(replacements: int, lost: int, flown: bool) -> None:
    """Replacing all workers takes that of a sound flight, too."""
    distributed = pytest.importorskip("distributed")
    campaign = parse_campaign(yaml.safe_load(CAMPAIGN))

    class Client:
        scheduler = SimpleNamespace(address="")
        asked = 0

        def submit(self, *_: Any, **__: Any) -> Any:
            self.asked += 1
            return SimpleNamespace(result=partial(self.result, self.asked))

        @staticmethod
        def result(asked: int) -> Any:
            if asked > lost:
                return [{"outcome": "flown"}]
            flies.replacements += asked <= replacements
            raise distributed.KilledWorker("task", None, 1)

    client = Client()
    flies = Cluster(client)
    (row,) = flies._fly_alone(campaign, 1)
    assert (row["outcome"] == "flown") == flown
    assert client.asked == 1 + (replacements > 0)
