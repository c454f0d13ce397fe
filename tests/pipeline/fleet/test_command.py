"""A fleet resumes, locks its folder, and reports the outcome of each run."""

from __future__ import annotations

import csv
import fcntl
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from bimvox_cli.main import run as command
from bimvox_pipeline.fleet.command import COLUMNS, fleet
from bimvox_pipeline.fleet.runs import RECORDS, Wish
from bimvox_pipeline.fleet.schedule import Execution
from full_disk import full_disk

from bimvox.errors import FileError
from bimvox.progress import SilentProgress

ROOT = Path(__file__).parents[3]


def planned(sites: Path, *wishes: Wish, fresh: bool = False) -> dict:
    return fleet(wishes, sites / "out", execution=Execution(jobs=1, fresh=fresh), progress=SilentProgress())


@pytest.mark.usefixtures("in_process")
def test_finished_runs_are_kept_until_something_changes(sites: Path):
    paper = Wish(sites / "paper.site.toml", policy="none")
    beside = Wish(sites / "paper.site.toml", sites / "beside.json", policy="none")
    gone = Wish(sites / "gone.site.toml")
    first = planned(sites, paper, beside, gone)
    assert (first["kept"], first["failed"], first["infeasible"]) == (0, 1, 0)
    out = sites / "out"
    table, log = (out / "summary.csv").read_bytes(), (out / "paper.mcap").read_bytes()
    again = planned(sites, paper, beside, gone)
    assert [run["kept"] for run in again["runs"]] == [True, True, False]
    assert (out / "summary.csv").read_bytes() == table
    # If an input, a log or a record changes or is damaged, that run is planned again, to the same bytes if possible.
    (sites / "beside.json").write_text((sites / "beside.json").read_text().replace("0.9", "0.8"))
    (out / "paper.mcap").write_bytes(log[:-1])
    third = planned(sites, paper, beside)
    assert third["kept"] == 0
    assert (out / "paper.mcap").read_bytes() == log
    (out / RECORDS / "paper.json").write_text("{")
    assert [run["kept"] for run in planned(sites, paper, beside)["runs"]] == [False, True]
    assert planned(sites, paper, fresh=True)["kept"] == 0


@pytest.mark.usefixtures("in_process")
@pytest.mark.parametrize("quiet", [[], ["-q"], ["--json"]])
def test_a_bad_site_among_others_is_bad_input(sites: Path, quiet: list[str], capsys: pytest.CaptureFixture[str]):
    file = sites / "some.toml"
    file.write_text('sites = ["gone.site.toml", "paper.site.toml"]\npolicy = "none"\n')
    assert command(["sweep", str(file), "-o", str(sites / "out"), "--jobs", "1", *quiet]) == 2
    out, err = capsys.readouterr()
    assert err.splitlines()[-1].startswith("error: 1 of 2 failed; gone: ")
    assert "no such file" in err
    assert (sites / "out" / "paper.mcap").exists()
    assert quiet != ["--json"] or json.loads(out)["failed"] == 1


@pytest.mark.usefixtures("in_process")
def test_the_table_has_one_row_per_run(sites: Path):
    found = planned(sites, Wish(sites / "yard.site.toml", policy="none"), Wish(sites / "gone.site.toml", seed=3))
    rows = list(csv.DictReader(Path(found["table"]).read_text().splitlines()))
    assert list(rows[0]) == list(COLUMNS)
    yard, gone = rows
    assert (yard["run"], yard["status"], yard["error"], yard["verified"]) == ("yard", "planned", "", "true")
    figures = found["runs"][0]["figures"]
    assert float(yard["search_share"]) == figures["shares"]["search"] == 1.0
    assert float(yard["hook_travel_m"]) == figures["hook_travel_m"] > 0
    assert (gone["run"], gone["status"], gone["lifts"], gone["seed"]) == ("gone-seed3", "failed", "", "3")
    assert "no such file" in gone["error"]
    page = Path(found["page"]).read_text(encoding="utf-8")
    assert page.index(">yard<") < page.index(">gone-seed3<")
    assert '<a href="yard.mcap">log</a>' in page
    assert 'href="gone' not in page
    if len(found["tables"]) > 1:
        from pyarrow import parquet

        assert parquet.read_table(found["tables"][1]).to_pylist()[0]["moves"] == figures["moves"]


@pytest.mark.usefixtures("in_process")
def test_a_folder_has_one_fleet_at_a_time(sites: Path):
    out = sites / "out"
    (out / RECORDS).mkdir(parents=True)
    (out / ".bimvox-0123.part").write_text("half")
    with (out / ".fleet.lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(FileError, match="another bimvox is planning"):
            planned(sites, Wish(sites / "gone.site.toml"))
    planned(sites, Wish(sites / "gone.site.toml"))
    assert not (out / ".bimvox-0123.part").exists()
    with pytest.raises(FileError, match="cannot be used"):
        fleet([Wish(sites / "x")], sites / "paper.ifc", progress=SilentProgress())


@pytest.mark.slow
def test_several_sites_are_planned_in_one_command(sites: Path, capsys: pytest.CaptureFixture[str]):
    names = [str(sites / name) for name in ("paper.site.toml", "yard.site.toml")]
    arguments = ["plan", *names, "--policy", "none", "--jobs", "2", "-o", str(sites / "both")]
    assert command([*arguments, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [run["run"] for run in document["runs"]] == ["paper", "yard"]
    assert document["verified"] is True
    assert command(arguments) == 0
    assert "2 of them kept" in capsys.readouterr().out
    # Each log is the one that `bimvox plan` writes for that site.
    assert command(["plan", names[1], "--policy", "none", "-o", str(sites / "alone.mcap"), "-q"]) == 0
    assert (sites / "alone.mcap").read_bytes() == (sites / "both" / "yard.mcap").read_bytes()


@pytest.mark.slow
@pytest.mark.usefixtures("in_process")
@pytest.mark.parametrize(
    ("backend", "number"),
    [("loky", signal.SIGINT), ("loky", signal.SIGKILL), ("dask", signal.SIGINT), ("ray", signal.SIGINT)],
)
def test_a_stopped_sweep_resumes(sites: Path, backend: str, number: signal.Signals, capsys: pytest.CaptureFixture[str]):
    pytest.importorskip({"dask": "distributed", "loky": "joblib"}.get(backend, backend))
    # Forty more runs, so that some are still to be done when the first has ended, however fast the machine is.
    more = "".join(f'[[run]]\nsite = "yard.site.toml"\npolicy = "none"\nseed = {seed}\n' for seed in range(40))
    (sites / "s.toml").write_text(f'[[run]]\nsite = "paper.site.toml"\npolicy = "none"\n{more}')
    arguments = ["sweep", str(sites / "s.toml"), "-o", str(sites / "out")]
    program = "import sys; from bimvox_cli.main import run; sys.exit(run())"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "BIMVOX_POLICIES": str(sites / "policies")}
    with subprocess.Popen(
        [sys.executable, "-c", program, *arguments, "--jobs", "2", "--backend", backend],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as stopped:
        record = sites / "out" / RECORDS / "paper.json"
        until = time.monotonic() + 120
        while not record.exists() and time.monotonic() < until:
            time.sleep(0.1)
        if number is signal.SIGINT:
            os.killpg(stopped.pid, number)  # like a terminal: to the command and its workers
        else:
            stopped.kill()
        assert stopped.wait(30) == (130 if number is signal.SIGINT else -number)
        assert stopped.stderr is not None
        said = stopped.stderr.read() if number is signal.SIGINT else ""
    assert "Traceback" not in said
    before = record.read_bytes()
    (sites / "s.toml").write_text(
        '[[run]]\nsite = "paper.site.toml"\npolicy = "none"\n[[run]]\nsite = "yard.site.toml"\npolicy = "none"\n'
    )
    assert command([*arguments, "--jobs", "1", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [run["kept"] for run in document["runs"]] == [True, False]
    assert record.read_bytes() == before


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="limits the size of files")
def test_a_full_disk_is_one_sentence(sites: Path, capfd: pytest.CaptureFixture[str]):
    (sites / "some.toml").write_text('sites = ["paper.site.toml"]\npolicy = "none"\nseeds = [1, 2]\n')
    with full_disk(320):
        code = command(["sweep", str(sites / "some.toml"), "-o", str(sites / "out"), "--jobs", "2", "-q"])
    said = capfd.readouterr().err
    assert code == 2
    assert "file too large; nothing was changed" in said
    assert "Traceback" not in said
    assert len(said.splitlines()) == 2
    assert not list((sites / "out").rglob("*.part"))
