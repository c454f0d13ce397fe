"""The same runs on every backend give the same bytes, and workers that die change nothing."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Sequence
from pathlib import Path

import pytest
from bimvox_pipeline.fleet.command import fleet, sweep, write_tables
from bimvox_pipeline.fleet.runs import RECORDS, Run, Wish, Work, log_file, record_file, runs_of
from bimvox_pipeline.fleet.schedule import Execution, carry_out_all, opened
from fleet_work import dies_as_named, dies_once_and_plans, plans_with_a_policy_from_scratch

from bimvox.errors import InputError
from bimvox.progress import SilentProgress

BACKENDS = ("loky", "dask", "ray")
pytestmark = pytest.mark.slow
NEEDS = {"loky": "joblib", "dask": "distributed", "ray": "ray"}
SUPPORT = Path(__file__).parents[2] / "support"


@pytest.fixture(params=BACKENDS)
def backend(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Yield an installed backend on its own cluster; its workers can import this repository and tests/support."""
    pytest.importorskip(NEEDS[request.param], reason=f"the extra bimvox[{request.param}] is not installed")
    paths = [str(SUPPORT), str(SUPPORT.parents[1]), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
    return str(request.param)


def test_the_results_are_the_same_to_the_byte(sites: Path, backend: str):
    (sites / "all.toml").write_text(
        'sites = ["paper.site.toml", "gone.site.toml"]\nobstructions = ["none", "beside.json"]\npolicy = "none"\n'
    )
    here, there = sites / "here", sites / "there"
    for folder, chosen, jobs in ((here, "loky", 1), (there, backend, 2)):
        found = sweep(sites / "all.toml", folder, execution=Execution(chosen, jobs), progress=SilentProgress())  # type: ignore[arg-type]
        assert [run["run"] for run in found["runs"]] == ["paper", "paper-beside", "gone", "gone-beside"]
        assert [run["status"] for run in found["runs"]] == ["planned", "planned", "failed", "failed"]
        assert (found["failed"], found["verified"]) == (2, False)
    for name in sorted(file.name for file in here.iterdir() if file.is_file()):
        assert (here / name).read_bytes() == (there / name).read_bytes(), name
    for file in (here / RECORDS).iterdir():
        records = [json.loads((folder / RECORDS / file.name).read_bytes()) for folder in (here, there)]
        for record in records:
            record.pop("seconds", None)
        assert records[0] == records[1]


@pytest.mark.parametrize("backend", ["loky", "dask"], indirect=True)
def test_ctrl_c_does_not_reach_the_workers(backend: str):
    from joblib import Parallel, delayed, parallel_config

    with opened(backend, 2, None) as config, parallel_config(**config):  # type: ignore[arg-type]
        held_back = Parallel(batch_size=1)(delayed(signal.pthread_sigmask)(signal.SIG_BLOCK, ()) for _ in range(4))
    assert [signal.SIGINT in masked for masked in held_back] == [True] * 4
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def carried_out(runs: Sequence[Run], folder: Path, backend: str, work: Work) -> dict[str, dict]:
    """Carry out runs, two at a time, and return their records by name."""
    (folder / RECORDS).mkdir(parents=True)
    execution = Execution(backend, jobs=2)  # type: ignore[arg-type]
    carry_out_all(runs, folder, execution, work=work, progress=SilentProgress())
    assert not list(folder.glob("runs/*.begun"))
    return {run.name: json.loads(record_file(folder, run.name).read_bytes()) for run in runs}


def test_twenty_runs_survive_workers_that_die(tmp_path: Path, backend: str):
    names = [f"run-{number}" for number in range(20)]
    names[3], names[8], names[12], names[15] = "process-once", "worker-once", "process-always", "worker-once-15"
    runs = [Run(name, Wish(Path(f"{name}.site.toml")), leads=name < "run-15") for name in names]
    records = carried_out(runs, tmp_path / "out", backend, dies_as_named)
    errors = {name: record["error"] for name, record in records.items()}
    assert {name for name, error in errors.items() if error["code"] == "died"} == {"process-always"}
    assert "SIGKILL" in errors["process-always"]["message"]
    assert "3 times" in errors["process-always"]["message"]
    assert {error["message"] for error in errors.values() if error["code"] == "tried"} == {"threads 1"}


def test_workers_that_die_change_no_byte(sites: Path, backend: str):
    paper = sites / "paper.site.toml"
    wishes = [Wish(paper, policy="none"), Wish(paper, sites / "beside.json", policy="none")]
    undisturbed = sites / "undisturbed"
    fleet(wishes, undisturbed, execution=Execution(jobs=1), progress=SilentProgress())
    records = carried_out(runs_of(wishes), sites / "out", backend, dies_once_and_plans)
    write_tables(sites / "out", list(records.values()))
    for name in sorted(file.name for file in undisturbed.iterdir() if file.suffix in (".mcap", ".csv")):
        assert (sites / "out" / name).read_bytes() == (undisturbed / name).read_bytes(), name
    assert len(list(sites.glob("*.died"))) == 2


def trained(sites: Path, backend: str) -> list[bytes]:
    """Carry out two runs of one site that train, and return their logs."""
    paper, folder = sites / "paper.site.toml", sites / f"trained-{backend}"
    runs = runs_of([Wish(paper, steps=256), Wish(paper, sites / "beside.json", steps=256)])
    assert [run.leads for run in runs] == [True, False]
    records = list(carried_out(runs, folder, backend, plans_with_a_policy_from_scratch).values())
    assert [(record["status"], record["error"]) for record in records] == [("planned", None)] * 2
    assert records[0]["policy"] == records[1]["policy"]
    assert "train" in records[0]["seconds"]
    assert "train" not in records[1]["seconds"]
    return [log_file(folder, run.name).read_bytes() for run in runs]


LOGS: list[list[bytes]] = []


def test_runs_that_train_share_what_the_first_of_them_learned(sites: Path, backend: str):
    """Runs learn the same on every backend: one thread per worker and one seed give the same bytes."""
    LOGS.append(trained(sites, backend))
    assert LOGS[-1] == LOGS[0]  # made by the backend that was tested first


def test_what_cannot_be_opened_is_reported(monkeypatch: pytest.MonkeyPatch):
    with pytest.raises(InputError, match="no --cluster"), opened("loky", 2, "tcp://127.0.0.1:1"):
        pass
    for backend in ("ray", "dask"):
        for module in (NEEDS[backend], backend):
            monkeypatch.setitem(__import__("sys").modules, module, None)
        with (
            pytest.raises(InputError, match=f"--backend {backend} is not installed") as caught,
            opened(backend, 2, None),
        ):
            pass
        assert f"bimvox[{backend}]" in str(caught.value.hint)
