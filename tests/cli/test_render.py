from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from bimvox_cli.main import run
from bimvox_pipeline.render.scene import moment_of
from box_sites import box_mesh
from drawn_plans import motions_by_hand, plan_by_hand
from paper_results import results
from PIL import Image

from bimvox.log.plan_log import PlanLog
from bimvox.log.recorder import write_log

SIZE = ["--size", "120x80"]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    plan = plan_by_hand(crane=True)
    path = tmp_path_factory.mktemp("log") / "boxes.mcap"
    with path.open("wb") as stream:
        write_log(stream, PlanLog(plan=plan, motions=motions_by_hand(plan)))
    return path


def pixels(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


@pytest.mark.parametrize("suffix", ["gif", "webp"])
def test_a_log_becomes_an_animation(log, tmp_path, capsys, suffix):
    out = tmp_path / f"boxes.{suffix}"
    assert run(["render", str(log), "-o", str(out), *SIZE, "--fps", "5", "--seconds", "1.6", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    image = Image.open(out)
    assert image.n_frames == document["frames"] == 8
    assert image.size == (120, 80)
    assert document["frame_ms"] == 200
    assert document["bytes"] == out.stat().st_size
    assert (document["from_s"], document["to_s"]) == (0.0, 1800.0)
    assert [file.name for file in tmp_path.iterdir()] == [out.name]


def test_an_animation_of_one_lift_shows_only_that(log, tmp_path, capsys):
    out = tmp_path / "lift.gif"
    code = run(["render", str(log), "-o", str(out), *SIZE, "--lift", "beam-b", "--seconds", "0.4", "--json"])
    assert code == 0
    document = json.loads(capsys.readouterr().out)
    assert document["lifts"] == [1]
    assert (document["from_s"], document["to_s"]) == (600.0, 1200.0)


def test_an_interrupted_animation_leaves_the_old_file(log, tmp_path, monkeypatch, capsys):
    out = tmp_path / "boxes.gif"
    out.write_bytes(b"before")

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("bimvox.rendering.pictures.film.picture_of", interrupted)
    assert run(["render", str(log), "-o", str(out), *SIZE]) == 130
    assert out.read_bytes() == b"before"
    assert [file.name for file in tmp_path.iterdir()] == ["boxes.gif"]


def test_a_picture_at_a_time_with_fewer_layers(log, tmp_path, capsys):
    for name, options in {
        "start": ["--time", "0"],
        "half": ["--time", "50%"],
        "clock": ["--time", "0:15:00"],
        "bare": ["--time", "50%", "--hide", "crane,paths", "--hide", "words"],
        "near": ["--time", "50%", "--focus", "silo"],
        "lift": ["--time", "25%", "--lift", "roof"],
    }.items():
        assert run(["render", str(log), "-o", str(tmp_path / f"{name}.png"), *SIZE, *options, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["size"] == [120, 80]
    pictures = {path.stem: pixels(path) for path in tmp_path.glob("*.png")}
    assert (pictures["half"] == pictures["clock"]).all()
    for name in ("start", "bare", "near", "lift"):
        assert (pictures[name] != pictures["half"]).any()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-o", "x.gif", "--time", "5"], "--time"),
        (["-o", "x.gif", "--focus", "roof"], "--focus"),
        (["-o", "x.gif", "--fps", "0"], "frames a second"),
        (["-o", "x.gif", "--seconds", "0"], "0 seconds"),
        (["-o", "x.gif", "--seconds", "3600", "--fps", "50"], "frames"),
        (["-o", "x.webp", "--lift", "beam-c"], "beam-"),
        (["-o", "x.png", "--time", "half past two"], "not a time"),
        (["-o", "x.png", "--time", "99:00:00"], "not in the plan"),
        (["-o", "x.png", "--time", "120%"], "share"),
        (["-o", "x.png", "--hide", "cranes"], "crane"),
        (["-o", "x.png", "--focus", "beam-c"], "beam-"),
        (["-o", "x.bmp"], "PNG"),
    ],
)
def test_what_cannot_be_drawn_is_reported_and_nothing_is_written(log, tmp_path, monkeypatch, capsys, arguments, words):
    monkeypatch.chdir(tmp_path)
    assert run(["render", str(log), *arguments]) == 2
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_model_is_drawn_at_any_cell_size_with_a_part_in_focus(tmp_path, capsys):
    model = tmp_path / "boxes.obj"
    lines, first = [], 1
    for name, low, high in (("low", (0, 0, 0), (4, 2, 1)), ("high", (1, 0, 1), (3, 2, 3))):
        mesh = box_mesh(low, high)
        lines += [f"o {name}", *(f"v {x} {y} {z}" for x, y, z in mesh.vertices_m.tolist())]
        lines += [f"f {a + first} {b + first} {c + first}" for a, b, c in mesh.faces.tolist()]
        first += len(mesh.vertices_m)
    model.write_text("\n".join(lines) + "\n")
    for name, options in {"coarse": [], "near": ["--focus", "high"]}.items():
        out = tmp_path / f"{name}.png"
        assert run(["render", str(model), "-o", str(out), *SIZE, "--voxel-size", "0.5", *options, "-q"]) == 0
    assert (pixels(tmp_path / "coarse.png") != pixels(tmp_path / "near.png")).any()
    capsys.readouterr()
    assert run(["render", str(model), "-o", str(tmp_path / "x.png"), "--voxel-size", "0.5", "--focus", "hihg"]) == 2
    assert "high" in capsys.readouterr().err
    assert run(["render", str(model), "-o", str(tmp_path / "x.gif")]) == 2
    assert "only a log can be animated" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "seconds"), [("90", 90.0), ("1:30", 90.0), ("1:02:03.5", 3723.5), ("25%", 250.0), (" 0 ", 0.0)]
)
def test_times_are_read(words, seconds):
    assert moment_of(words, 0, 1000 * 10**9) == round(seconds * 1e9)


def test_an_experiment_is_drawn_as_its_curves(tmp_path, monkeypatch, capsys):
    folder = tmp_path / "runs"
    folder.mkdir()
    (folder / "experiment.json").write_text("{}")
    monkeypatch.setattr("bimvox_pipeline.paper.load_results", lambda found: results() if found == folder else None)
    monkeypatch.chdir(tmp_path)
    assert run(["render", str(folder), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["kind"], document["out"]) == ("experiment", "runs.png")
    assert len(np.unique(pixels(tmp_path / "runs.png").reshape(-1, 3), axis=0)) > 50
    assert run(["render", str(folder), "-o", "runs.svg"]) == 0
    assert b"<svg" in (tmp_path / "runs.svg").read_bytes()
    assert run(["render", str(folder), "-o", "runs.gif"]) == 2
    assert "PNG or SVG" in capsys.readouterr().err


def test_an_experiment_of_another_version_is_reported(tmp_path, monkeypatch, capsys):
    def lacking(_folder: Path) -> None:
        raise KeyError("fresh_layouts")

    (tmp_path / "experiment.json").write_text("{}")
    monkeypatch.setattr("bimvox_pipeline.paper.load_results", lacking)
    assert run(["render", str(tmp_path), "-o", str(tmp_path / "x.png")]) == 2
    assert "another version" in capsys.readouterr().err


def test_a_folder_that_is_not_an_experiment_is_not_drawn(tmp_path, capsys):
    assert run(["render", str(tmp_path), "-o", str(tmp_path / "x.png")]) == 2
    assert "folder" in capsys.readouterr().err
