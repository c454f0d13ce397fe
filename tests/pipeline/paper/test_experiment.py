from __future__ import annotations

import csv
import json
import multiprocessing
from dataclasses import replace

import pytest
from bimvox_pipeline import paper as scheduler
from bimvox_pipeline.paper import load_results, result_file, run_experiment, run_jobs

from bimvox.errors import BimvoxError, FileError
from bimvox.paper.experiment.document import document_of, mean_curve
from bimvox.paper.experiment.jobs import Job, jobs_of, quick_settings
from bimvox.paper.policy.curve import CurvePoint
from bimvox.progress import SilentProgress

SETTINGS = replace(quick_settings(1, ("ours",)), frame_changes={"sites": 4, "gradient_steps": 1, "greedy_too": False})


@pytest.fixture(scope="module")
def experiment(tmp_path_factory):
    folder = tmp_path_factory.mktemp("experiment") / "out"
    progress = SilentProgress()
    return folder, run_experiment(folder, settings=SETTINGS, processes=1, progress=progress), progress


@pytest.mark.slow
def test_everything_is_run_and_reported(experiment):
    _, results, progress = experiment
    assert results.is_complete
    assert "paper" in progress.seconds
    assert len(results.initialization) == 1
    assert {run.mode for run in results.beyond} == {"targets", "frame"}
    assert results.field_seconds["paper"] > 0.0
    assert results.baselines[0].teacher_success == 1.0


@pytest.mark.slow
def test_results_are_read_back_as_they_were(experiment):
    folder, results, _ = experiment
    assert load_results(folder) == results


@pytest.mark.slow
def test_the_document_has_everything_in_the_contract(experiment):
    folder, results, _ = experiment
    document = json.loads((folder / "results.json").read_text())
    assert document == document_of(results)
    assert set(document["scenarios"]) == {"a", "b", "c", "d"}
    for scenario in document["scenarios"].values():
        assert {"steps_to_success", "success_rate", "curve", "path_cells"} <= set(scenario)
    assert {"modes", "ablation", "beyond", "baselines", "teacher", "settings"} <= set(document)
    assert [finding["number"] for finding in document["modes"]["ours"]["findings"]] == [1, 2, 3]


@pytest.mark.slow
def test_paths_and_obstructions_of_the_scenarios(experiment):
    _, results, _ = experiment
    runs = {run.scenario: run for run in results.scenarios}
    assert [len(runs[name].obstructions) for name in "abcd"] == [0, 1, 2, 1]
    for run in runs.values():
        assert run.planned_cells[0][:2] == run.start[:2]
        assert run.planned_cells[-1] == run.target
        if run.succeeded:
            assert run.path_cells[-1] == run.target
            assert len(run.path_cells) - 1 >= run.shortest_moves
    assert runs["a"].path_cells == runs["a"].planned_cells


@pytest.mark.slow
def test_every_test_of_every_curve_is_in_the_table(experiment):
    folder, results, _ = experiment
    with (folder / "curves.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    parts = {row["part"] for row in rows}
    assert {"initialization", "beyond", "application", "tabular"} == parts
    curve = [(int(row["steps"]), float(row["success_rate"])) for row in rows if row["part"] == "initialization"]
    assert curve == [(row.steps, row.success_rate) for row in results.initialization[0].curve]


@pytest.mark.slow
def test_running_again_does_only_what_is_missing(experiment, monkeypatch):
    folder, results, _ = experiment
    monkeypatch.setattr(scheduler, "ProcessPoolExecutor", None)  # nothing left to do
    progress = SilentProgress()
    assert run_experiment(folder, settings=SETTINGS, progress=progress) == results
    gone = next(job for job in jobs_of(SETTINGS) if job.part == "baseline")
    file = result_file(folder / "jobs", gone.name)
    content = file.read_bytes()
    file.unlink()
    partial = load_results(folder)
    assert partial.missing == (gone.name,)
    assert partial.baselines == ()
    assert document_of(partial)["complete"] is False
    file.write_bytes(content)


@pytest.mark.slow
def test_a_job_that_fails_stops_the_run(tmp_path):
    job = Job("initialize", "paper", 0, {"config": {}})
    with pytest.raises(BimvoxError, match="other keys"):
        run_jobs([job], tmp_path, processes=1, done=lambda job: None)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_not_an_experiment(tmp_path):
    with pytest.raises(FileError, match="no such file"):
        load_results(tmp_path)


def test_a_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(FileError, match="cannot be made"):
        run_experiment(tmp_path / "file" / "out", settings=SETTINGS, progress=SilentProgress())


def test_mean_curves_keep_the_last_rate_of_runs_that_stopped():
    short = (CurvePoint(100, 0.2, 0.0, None), CurvePoint(200, 1.0, 0.0, None))
    long = (CurvePoint(100, 0.0, 0.0, None), CurvePoint(200, 0.4, 0.0, None), CurvePoint(300, 0.8, 0.0, None))
    rows = mean_curve([short, long])
    assert [row[:2] for row in rows] == [[100.0, pytest.approx(0.1)], [200.0, pytest.approx(0.7)], [300.0, 0.9]]
    assert all(0.0 <= row[2] <= row[1] <= row[3] <= 1.0 for row in rows)
    assert mean_curve([()]) == []


@pytest.mark.slow
def test_ctrl_c_ends_the_processes_and_keeps_what_was_finished(tmp_path):
    """A run interrupted after its first job leaves no processes, and keeps the finished result."""
    jobs = jobs_of(SETTINGS)

    def interrupt(job):
        raise KeyboardInterrupt

    before = set(multiprocessing.active_children())
    with pytest.raises(KeyboardInterrupt):
        run_jobs(jobs, tmp_path, processes=1, done=interrupt)
    assert set(multiprocessing.active_children()) <= before
    assert sum(result_file(tmp_path, job.name).exists() for job in jobs) == 1
    assert list(tmp_path.glob("*.part")) == list(tmp_path.glob(".*.part")) == []
