from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Iterator, List

import jsbsim
import pandas as pd
import pytest

from xplane_bridge.analysis.intervals import wilson
from xplane_bridge.campaign import cluster as cluster_module
from xplane_bridge.campaign.cluster import Cluster, local_cluster, running_cluster
from xplane_bridge.campaign.definition import Campaign, CampaignError, parse_campaign
from xplane_bridge.campaign.fingerprint import fingerprint
from xplane_bridge.campaign.flight import Flight
from xplane_bridge.campaign.rows import VARYING, cpu_kind, fly_rows
from xplane_bridge.campaign.runner import CAMPAIGN, CHUNK, PARTS, TABLE, CampaignFolder, in_process
from xplane_bridge.cli import run_campaign
from xplane_bridge.resources import config_file, program

#: Flies a campaign and is killed in place of the renaming that gives a file this name.
KILLED = """
import os, signal, sys
from xplane_bridge.cli.run_campaign import main
name, rename = sys.argv[1], os.replace
def replace(source, target):
    if os.path.basename(target) == name:
        os.kill(os.getpid(), signal.SIGKILL)
    rename(source, target)
os.replace = replace
sys.exit(main(sys.argv[2:]))
"""


def document(**more: Any) -> dict:
    """A fifth of a second of flight with a stick that differs."""
    return {
        "name": "c",
        "parameters": {"share": {"uniform": [0, 1]}, "height": {"uniform": [0, 1000]}},
        "weather": {"turbulence": 1.0},
        "flights": 14,
        "scenario": {
            "name": "s",
            "description": "$height m",
            "aircraft": "fixed_wing",
            "start": {"speed": 70, "altitude": 1000},
            "criteria": {"high": {"measure": "maximum", "of": "roll", "below": 90}},
            "events": [{"at": 0, "stick": {"roll": "$share"}}, {"at": 0.2, "end": True}],
        },
        **more,
    }


def same(table: pd.DataFrame) -> pd.DataFrame:
    """Without the columns that may differ."""
    return table[[name for name in table.columns if not name.startswith(VARYING)]]


def quiet(_count: int) -> None:
    pass


def test_the_table_is_the_same_for_any_worker_and_after_a_resumption(tmp_path: Path) -> None:
    campaign = parse_campaign(document())
    alone = CampaignFolder(tmp_path / "alone").fly(campaign, in_process, quiet)
    assert list(alone["flight"]) == list(range(14))
    assert set(alone["outcome"]) == {"flown"}
    assert alone["sha256"].nunique() == 14

    resumed = CampaignFolder(tmp_path / "resumed")

    def dies(campaign: Campaign, chunks: Any) -> Any:
        yield fly_rows(campaign.document, *chunks[1])  # out of order
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        resumed.fly(campaign, dies, quiet)
    (tmp_path / "resumed/parts/flights-00000000-0010.parquet.tmp").write_bytes(b"half a part")
    flown: List[tuple] = []

    def rest(campaign: Campaign, chunks: Any) -> Any:
        flown.extend(chunks)
        return in_process(campaign, reversed(chunks))

    table = resumed.fly(campaign, rest, quiet)
    assert flown == [(0, 10)]
    pd.testing.assert_frame_equal(same(table), same(alone))
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "resumed" / TABLE), table)
    assert Flight(campaign.plan(11)).fly().sha256 == alone["sha256"][11]


def test_one_and_two_workers_and_a_killed_one_give_the_same_table(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    campaign = parse_campaign(document())
    expected = same(CampaignFolder(tmp_path / "0").fly(campaign, in_process, quiet))
    for workers in (1, 2):
        with local_cluster(workers) as cluster:
            table = CampaignFolder(tmp_path / str(workers)).fly(campaign, cluster, quiet)
        pd.testing.assert_frame_equal(same(table), expected)
    with local_cluster(2) as cluster:
        killed: List[int] = []

        def kill_one(_count: int) -> None:
            if not killed:
                killed.extend(cluster.worker_pids()[:1])
                os.kill(killed[0], signal.SIGKILL)

        table = CampaignFolder(tmp_path / "killed").fly(campaign, cluster, kill_one)
    assert killed
    pd.testing.assert_frame_equal(same(table), expected)


@pytest.mark.full
def test_workers_that_dask_gives_up_are_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster_module, "_EMPTY_S", 2.0)
    campaign = parse_campaign(document(flights=60))
    expected = same(CampaignFolder(tmp_path / "alone").fly(campaign, in_process, quiet))
    killed: List[int] = []
    with local_cluster(1) as cluster:

        async def gives_up() -> None:  # as of a worker that ends while it starts
            pass

        def kill_all(_count: int) -> None:
            if not killed:
                for nanny in cluster._client.cluster.workers.values():
                    nanny.instantiate = gives_up
                killed.extend(cluster.worker_pids())
                os.kill(killed[0], signal.SIGKILL)

        table = CampaignFolder(tmp_path / "killed").fly(campaign, cluster, kill_all)
    assert killed
    pd.testing.assert_frame_equal(same(table), expected)


class SlowCluster:
    """Dask's, whose workers never come; it is over when they have been started so often."""

    def __init__(self, starts: int) -> None:
        self.scheduler = self
        self.workers: List[str] = []
        self.over = threading.Event()
        self.starts = starts
        self.begun_s: List[float] = []

    def scale(self, workers: int) -> None:
        if workers == 0:
            return
        self.begun_s.append(time.monotonic())
        if len(self.begun_s) == self.starts:
            self.over.set()


def test_workers_that_start_slowly_have_more_time_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "_EMPTY_S", 0.05)
    monkeypatch.setattr(cluster_module, "_LOOK_S", 0.01)
    slow, began_s = SlowCluster(starts=4), time.monotonic()
    flies = Cluster(SimpleNamespace(scheduler=SimpleNamespace(address="")))
    cluster_module._replenish(slow, 2, slow.over, flies)
    waits = [after - before for before, after in zip([began_s, *slow.begun_s], slow.begun_s)]
    assert [wait > 0.05 * 2**number for number, wait in enumerate(waits)] == [True] * 4, waits
    assert flies.replacements == 4


def deadly(state: Any) -> dict:
    if state.sim_time_unwrapped > 0.1 and state.altitude_msl > 1500.0:
        os._exit(1)  # as a crash in compiled code does
    return {}


@pytest.mark.full
def test_a_flight_that_ends_its_worker_is_a_row(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    campaign = parse_campaign(
        document(
            flights=12,
            controller=f"{__name__}:deadly",
            parameters={"share": {"uniform": [0, 1]}, "height": {"choice": [1000, 1000, 1000, 2000]}},
            sampling="latin_hypercube",
            scenario={**document()["scenario"], "start": {"speed": 70, "altitude": "$height"}},
        )
    )
    with local_cluster(2) as cluster:
        table = CampaignFolder(tmp_path).fly(campaign, cluster, quiet)
    died = table["outcome"] == "worker died"
    assert list(died) == list(table["parameter_height"] == 2000.0)
    assert died.sum() == 3
    assert set(table["outcome"][~died]) == {"flown"}
    assert not table["passed"][died].any()


def test_the_interval_covers_a_known_share(tmp_path: Path) -> None:
    """The criterion hangs on a parameter alone: a start at 200 m/s, 3 of 10, is refused, and is a row that failed."""
    parameters = {"speed": {"choice": [70] * 7 + [200] * 3}, "share": {"uniform": [0, 1]}}
    scenario = {**document()["scenario"], "description": "", "start": {"speed": "$speed"}}
    campaign = parse_campaign(document(flights=40, parameters=parameters, scenario=scenario, seed=5))
    table = CampaignFolder(tmp_path).fly(campaign, in_process, quiet)
    assert len(table) == 40
    assert list(table["passed"]) == list(table["parameter_speed"] == 70.0)
    assert set(table["outcome"]) == {"flown", "no start"}
    assert table["reason"][table["outcome"] == "no start"].str.contains("airspeed 200").all()
    low, high = wilson(int(table["passed"].sum()), 40)
    assert low <= 0.7 <= high


def test_95_of_100_intervals_cover_a_known_share() -> None:
    covered = 0
    for seed in range(200):
        design = parse_campaign(document(seed=seed, flights=50)).design
        low, high = wilson(sum(design.values(i)["share"] < 0.3 for i in range(50)), 50)
        covered += low <= 0.3 <= high
    assert 0.90 * 200 <= covered <= 0.99 * 200  # three deviations of a binomial count about 95 %


def test_it_stops_when_the_interval_is_narrow_enough_and_looks_only_after_whole_rounds(tmp_path: Path) -> None:
    # All pass: the interval is 1 - 1 / (1 + 3.84 / n) wide, at most 0.2 from n = 16 on; looks at 10 and 20.
    campaign = parse_campaign(document(flights=60, stop={"width": 0.2, "every": 10}))
    assert len(CampaignFolder(tmp_path).fly(campaign, in_process, quiet)) == 20


def test_an_interrupted_campaign_stops_where_an_uninterrupted_one_does(tmp_path: Path) -> None:
    campaign = parse_campaign(document(flights=60, stop={"width": 0.17, "every": 20}))  # narrow enough from 19 on
    folder = CampaignFolder(tmp_path)
    assert len(folder.fly(campaign, in_process, quiet)) == 20
    later = CampaignFolder(tmp_path / "later")
    later.fly(parse_campaign(document(flights=60, stop={"width": 0.01, "every": 20})), in_process, quiet)
    for part in (later.folder / "parts").iterdir():  # of rounds that it need not have flown
        part.rename(folder.folder / "parts" / part.name)
    assert list(folder.fly(campaign, in_process, quiet)["flight"]) == list(range(20))


def test_a_folder_of_another_campaign_is_refused_and_so_is_one_in_use(tmp_path: Path) -> None:
    folder = CampaignFolder(tmp_path)
    campaign = parse_campaign(document(flights=1))
    folder.fly(campaign, in_process, quiet)
    with pytest.raises(CampaignError, match="another campaign"):
        folder.fly(parse_campaign(document(flights=1, seed=1)), in_process, quiet)
    with folder._locked(), pytest.raises(CampaignError, match="another run_campaign"):
        CampaignFolder(tmp_path).fly(campaign, in_process, quiet)
    with pytest.raises(CampaignError, match="holds no campaign"):
        CampaignFolder(tmp_path / "none").load()


def test_a_campaign_whose_controller_is_not_there_is_not_called_none(tmp_path: Path) -> None:
    document_of = {**document(flights=1), "controller": "only_there:Steady"}
    (tmp_path / CAMPAIGN).write_text(json.dumps({"campaign": document_of}))
    with pytest.raises(CampaignError, match=r"^controller: 'only_there:Steady' cannot be had \(No module"):
        CampaignFolder(tmp_path).load()


def test_what_cannot_be_written_is_a_line(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    folder, file = tmp_path / "flown", tmp_path / "c.json"
    file.write_text(json.dumps(document(flights=2)))
    fly = [str(file), "-o", str(folder), "--workers", "0"]
    in_the_way = folder / "report.html"
    in_the_way.mkdir(parents=True)
    assert run_campaign.main(fly) == 1
    said = capsys.readouterr().err.splitlines()[-1]
    assert f"{in_the_way}: Is a directory; all flights are in table.parquet: the same command draws them" in said
    in_the_way.rmdir()
    assert run_campaign.main(fly) == 0
    assert in_the_way.is_file()
    capsys.readouterr()
    (folder / "refly_1.csv").mkdir()
    assert run_campaign.main(["-o", str(folder), "--refly", "1"]) == 1
    said = capsys.readouterr().err
    assert f"{folder / 'refly_1.csv'}: Is a directory; --refly writes beside the campaign" in said
    assert said.count("\n") == 1
    (folder / "refly_1.csv").rmdir()
    (folder / "refly_1").write_text("")
    assert run_campaign.main(["-o", str(folder), "--refly", "1", "--through-nodes"]) == 1
    assert f"{folder / 'refly_1'}: File exists; " in capsys.readouterr().err


@pytest.mark.parametrize("given", [["c.yaml"], ["--flights", "3"], ["--workers", "0"], ["--scheduler", "tcp://a:1"]])
def test_what_refly_would_ignore_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture, given: List[str]) -> None:
    assert run_campaign.main([*given, "-o", str(tmp_path), "--refly", "1"]) == 1
    said = capsys.readouterr().err
    assert f"{given[-1]}: not with --refly, which flies what {tmp_path} holds" in said


def test_other_code_under_the_same_campaign_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    campaign = parse_campaign(document(flights=1))
    CampaignFolder(tmp_path).fly(campaign, in_process, quiet)
    monkeypatch.setattr("jsbsim.__version__", "0.0")
    with pytest.raises(CampaignError, match=r"flown with another jsbsim \(\d\S+ instead of 0\.0\), with which .* -o$"):
        CampaignFolder(tmp_path).fly(campaign, in_process, quiet)


def test_a_folder_of_another_kind_of_cpu_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    campaign = parse_campaign(document(flights=1))
    table = CampaignFolder(tmp_path).fly(campaign, in_process, quiet)
    assert list(table["host_cpu"]) == [cpu_kind()]
    monkeypatch.setattr("xplane_bridge.campaign.fingerprint.cpu_kind", lambda: "Other 9000")
    with pytest.raises(CampaignError) as raised:
        CampaignFolder(tmp_path).fly(campaign, in_process, quiet)
    assert f"flown with another kind of CPU ({cpu_kind()} instead of Other 9000), with which" in str(raised.value)
    assert "fly on with what they were flown with, or give another folder with -o" in str(raised.value)


@pytest.fixture(scope="module")
def elsewhere() -> Iterator[Any]:
    """A client of a scheduler with one worker, a process."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=":0", host="127.0.0.1"
    ) as cluster, distributed.Client(cluster, set_as_default=False) as client:
        yield client


def program_of(campaign: dict, folder: Path, *options: str) -> int:
    """Exit status of run_campaign in this process."""
    path = folder.with_suffix(".yaml")
    path.write_text(str(campaign), encoding="utf-8")  # JSON-like text is YAML
    return run_campaign.main([str(path), "-o", str(folder), *options])


def test_a_scheduler_elsewhere_gives_the_same_table(tmp_path: Path, elsewhere: Any) -> None:
    address = elsewhere.scheduler.address
    assert program_of(document(), tmp_path / "elsewhere", "--scheduler", address) == 0
    there = pd.read_parquet(tmp_path / "elsewhere" / TABLE)
    here = CampaignFolder(tmp_path / "here").fly(parse_campaign(document()), in_process, quiet)
    pd.testing.assert_frame_equal(same(there), same(here))
    assert set(there["host_pid"]) == set(elsewhere.run(os.getpid).values())
    assert set(here["host_pid"]) == {os.getpid()}


def test_a_worker_that_flies_with_something_else_is_refused(
    tmp_path: Path, elsewhere: Any, capsys: pytest.CaptureFixture
) -> None:
    (worker,) = elsewhere.scheduler_info()["workers"]
    elsewhere.run(setattr, jsbsim, "__version__", "0.0")
    try:
        assert program_of(document(), tmp_path / "c", "--scheduler", elsewhere.scheduler.address) == 1
    finally:
        elsewhere.run(setattr, jsbsim, "__version__", jsbsim.__version__)
    (line,) = capsys.readouterr().err.splitlines()
    assert f": worker {worker} has another jsbsim (0.0 instead of {jsbsim.__version__}), with which the same" in line
    assert line.endswith("or end it; then start the same command again")
    assert not list((tmp_path / "c/parts").iterdir())


def test_a_worker_that_cannot_fly_it_is_named(tmp_path: Path, elsewhere: Any, capsys: pytest.CaptureFixture) -> None:
    (tmp_path / "only_here.py").write_text("fly = dict\n", encoding="utf-8")
    campaign = document(controller="only_here:fly")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(tmp_path))
        assert program_of(campaign, tmp_path / "c", "--scheduler", elsewhere.scheduler.address) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert re.search(r": worker tcp://\S+ cannot fly this campaign \(CampaignError: .*'only_here:fly'", line)


def test_a_worker_that_comes_later_with_something_else_flies_nothing(elsewhere: Any) -> None:
    campaign = parse_campaign(document())
    (worker,) = elsewhere.scheduler_info()["workers"]
    with running_cluster(elsewhere.scheduler.address) as cluster:
        cluster.fingerprint(campaign)  # as of all that are there
        elsewhere.run(setattr, jsbsim, "__version__", "0.0")
        try:
            with pytest.raises(CampaignError, match=rf"worker {worker} has another jsbsim \(0\.0 instead of"):
                list(cluster(campaign, [(0, 1)]))
        finally:
            elsewhere.run(setattr, jsbsim, "__version__", jsbsim.__version__)
        assert [row["outcome"] for rows in cluster(campaign, [(0, 1)]) for row in rows] == ["flown"]


def test_workers_of_another_kind_of_cpu_than_this_one_fly_and_the_folder_is_theirs(
    tmp_path: Path, elsewhere: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("xplane_bridge.campaign.fingerprint.cpu_kind", lambda: "Other 9000")
    campaign = parse_campaign(document(flights=1))
    with running_cluster(elsewhere.scheduler.address) as cluster:
        assert set(CampaignFolder(tmp_path).fly(campaign, cluster, quiet)["host_cpu"]) == {cpu_kind()}
    assert json.loads((tmp_path / "campaign.json").read_text())["flown_with"]["kind of CPU"] == cpu_kind()
    with pytest.raises(CampaignError, match="another kind of CPU"):
        CampaignFolder(tmp_path).fly(campaign, in_process, quiet)


def test_workers_of_two_kinds_of_cpu_do_not_fly_together(elsewhere: Any) -> None:
    campaign = parse_campaign(document())
    own = fingerprint(campaign)

    class Two:
        scheduler = elsewhere.scheduler
        wait_for_workers = elsewhere.wait_for_workers

        def run(self, *_: Any, **__: Any) -> dict:
            return {"tcp://b:1": {**own, "kind of CPU": "B"}, "tcp://a:1": {**own, "kind of CPU": "A"}}

    with pytest.raises(CampaignError, match=r"worker tcp://b:1 has another kind of CPU \(B instead of A\)"):
        Cluster(Two()).fingerprint(campaign)


def test_a_scheduler_without_workers_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: Any) -> None:
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr("xplane_bridge.campaign.cluster._FIRST_WORKER_S", 0.1)
    with distributed.LocalCluster(n_workers=0, processes=False, protocol="tcp", dashboard_address=":0") as empty:
        assert program_of(document(), tmp_path / "c", "--scheduler", empty.scheduler_address) == 1
        assert f"at {empty.scheduler_address} has no workers; start some with" in capsys.readouterr().err


def test_a_scheduler_that_ends_midway_is_a_line_and_the_same_command_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=":0"
    )

    class Bar(run_campaign.tqdm):
        def update(self, count: int) -> None:
            if count:
                cluster.close()

    with cluster, monkeypatch.context() as patch:
        patch.setattr(run_campaign, "tqdm", Bar)
        address = cluster.scheduler_address
        assert program_of(document(), tmp_path / "c", "--scheduler", address) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert f": the Dask scheduler at {address} ended, or cannot be reached any more; what is done is kept" in line
    assert line.endswith("then start the same command again")
    assert len(list((tmp_path / "c/parts").glob("*.parquet"))) == 1
    campaign = parse_campaign(document())
    tables = [same(CampaignFolder(tmp_path / name).fly(campaign, in_process, quiet)) for name in ("c", "whole")]
    pd.testing.assert_frame_equal(*tables)


def test_the_program_killed_at_any_moment_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "c.yaml"
    path.write_text(str(document(flights=13)), encoding="utf-8")  # JSON-like text is YAML
    folder, parts = tmp_path / "killed", ["flights-00000000-0010.parquet", "flights-00000010-0003.parquet"]
    arguments = [str(path), "--workers", "0", "-o"]
    for there, missing in (([], CAMPAIGN), ([], parts[0]), (parts[:1], parts[1]), (parts, TABLE)):
        killed = [sys.executable, "-c", KILLED, missing, *arguments, str(folder)]
        assert subprocess.run(killed, check=False, stdout=subprocess.DEVNULL).returncode == -signal.SIGKILL
        assert [part.name for part in sorted((folder / PARTS).glob("*.parquet"))] == there
        assert (folder / CAMPAIGN).exists() == (missing != CAMPAIGN)
        assert not (folder / TABLE).exists()
    command = str(program("run_campaign"))
    for name in ("killed", "whole"):
        subprocess.run([command, *arguments, str(tmp_path / name)], check=True, stdout=subprocess.DEVNULL)
    tables = [same(pd.read_parquet(tmp_path / name / TABLE)) for name in ("killed", "whole")]
    pd.testing.assert_frame_equal(*tables)
    again = [command, "-o", str(folder), "--refly", "7"]
    assert subprocess.run(again, check=False, stdout=subprocess.DEVNULL).returncode == 0
    broken = pd.read_parquet(folder / PARTS / parts[0])
    broken.loc[7, "sha256"] = "0" * 64
    broken.to_parquet(folder / PARTS / parts[0])
    assert subprocess.run(again, check=False, stdout=subprocess.DEVNULL).returncode == 1


@pytest.mark.nightly
@pytest.mark.parametrize("flights", [200])
def test_the_shipped_example_is_one_table_with_one_worker_with_two_and_after_a_kill(
    tmp_path: Path, flights: int, record_property: Any
) -> None:
    """Whole, as a user flies it; wall times are printed, and noted in the results."""
    pytest.importorskip("distributed")
    example = str(config_file("campaigns", "stuck_aileron.yaml"))
    command = [str(program("run_campaign")), example, "--flights", str(flights)]

    def fly(name: str, workers: int) -> subprocess.Popen[bytes]:
        options = ["--workers", str(workers), "-o", str(tmp_path / name)]
        return subprocess.Popen([*command, *options], stdout=subprocess.DEVNULL)

    def note(name: str, began: float) -> None:
        record_property(f"{name}_wall_s", round(time.monotonic() - began, 1))
        print(f"stuck_aileron, {flights} flights, {name}: {time.monotonic() - began:.1f} s")

    for name, workers in (("one_worker", 1), ("two_workers", 2)):
        began = time.monotonic()
        assert fly(name, workers).wait() == 0
        note(name, began)
    began = time.monotonic()
    first = fly("killed", 2)
    while len(list((tmp_path / "killed/parts").glob("*.parquet"))) < flights // CHUNK // 2:
        assert first.poll() is None
        time.sleep(0.02)
    first.send_signal(signal.SIGKILL)
    first.wait()
    assert not (tmp_path / "killed" / TABLE).exists()
    assert fly("killed", 2).wait() == 0
    note("killed_and_resumed", began)
    one, *others = (same(pd.read_parquet(tmp_path / n / TABLE)) for n in ("one_worker", "two_workers", "killed"))
    assert len(one) == flights
    assert one["sha256"].nunique() == flights
    for other in others:
        pd.testing.assert_frame_equal(other, one)
