from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from bimvox_pipeline.render.render import render
from bimvox_pipeline.render.scene import SceneOptions
from bimvox_pipeline.voxelize import voxelize
from box_sites import box_mesh
from drawn_plans import motions_by_hand, plan_by_hand
from PIL import Image

from bimvox.errors import FileError, InputError, SelectionError
from bimvox.log.plan_log import PlanLog
from bimvox.log.recorder import write_log
from bimvox.progress import SilentProgress

SIZE = (160, 100)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    plan = plan_by_hand(crane=True)
    path = tmp_path_factory.mktemp("log") / "boxes.mcap"
    with path.open("wb") as stream:
        write_log(stream, PlanLog(plan=plan, motions=motions_by_hand(plan)))
    return path


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return two boxes as OBJ."""
    path = tmp_path_factory.mktemp("model") / "boxes.obj"
    lines, first = [], 1
    for name, low, high in (("low", (0, 0, 0), (4, 2, 1)), ("high", (1, 0, 1), (3, 2, 3))):
        mesh = box_mesh(low, high)
        lines += [f"o {name}", *(f"v {x} {y} {z}" for x, y, z in mesh.vertices_m.tolist())]
        lines += [f"f {a + first} {b + first} {c + first}" for a, b, c in mesh.faces.tolist()]
        first += len(mesh.vertices_m)
    path.write_text("\n".join(lines) + "\n")
    return path


def drawn(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB"))


def test_a_log_is_drawn_finished_and_under_way(log: Path, tmp_path: Path):
    done, lift = tmp_path / "done.png", tmp_path / "lift.png"
    document = render(log, done, size=SIZE, progress=SilentProgress())
    assert document["out"] == str(done)
    assert document["kind"] == "log"
    render(log, lift, size=SIZE, shown=SceneOptions(lift="beam-b"), progress=SilentProgress())
    assert drawn(done).shape == (100, 160, 3)
    assert (drawn(done) != drawn(lift)).any()


def test_the_same_file_gives_the_same_bytes(log: Path, tmp_path: Path):
    for name in ("a.png", "b.png"):
        render(log, tmp_path / name, size=SIZE, progress=SilentProgress())
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_the_angle_turns_the_picture(log: Path, tmp_path: Path):
    document = render(
        log, tmp_path / "a.png", size=SIZE, shown=SceneOptions(azimuth_deg=10.0), progress=SilentProgress()
    )
    assert document["azimuth_deg"] == 10.0
    render(log, tmp_path / "b.png", size=SIZE, shown=SceneOptions(azimuth_deg=200.0), progress=SilentProgress())
    assert (drawn(tmp_path / "a.png") != drawn(tmp_path / "b.png")).any()


def test_a_model_and_its_grid_are_drawn(model: Path, tmp_path: Path):
    progress = SilentProgress()
    assert render(model, tmp_path / "model.png", size=SIZE, progress=progress)["kind"] == "mesh"
    voxelize(model, tmp_path / "boxes.zarr.zip", voxel_size_m=0.25, progress=progress)
    document = render(tmp_path / "boxes.zarr.zip", tmp_path / "grid.png", size=SIZE, progress=progress)
    assert document["kind"] == "grid"
    assert len(np.unique(drawn(tmp_path / "grid.png").reshape(-1, 3), axis=0)) > 20


def test_the_picture_is_named_after_its_source(log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    assert render(log, size=SIZE, progress=SilentProgress())["out"] == "boxes.png"
    assert (tmp_path / "boxes.png").exists()


def test_a_missing_lift_is_named_with_its_neighbour(log: Path, tmp_path: Path):
    with pytest.raises(SelectionError, match="beam-b"):
        render(log, tmp_path / "x.png", shown=SceneOptions(lift="beam-bb"), progress=SilentProgress())
    assert not (tmp_path / "x.png").exists()


def test_what_cannot_be_drawn_is_reported_before_the_work(log: Path, model: Path, tmp_path: Path):
    silent = SilentProgress()
    with pytest.raises(InputError, match="PNG"):
        render(log, tmp_path / "x.jpeg", progress=silent)
    with pytest.raises(InputError, match="only a log"):
        render(model, tmp_path / "x.png", shown=SceneOptions(lift="low"), progress=silent)
    with pytest.raises(InputError, match="pixels"):
        render(log, tmp_path / "x.png", size=(1, 1), progress=silent)
    with pytest.raises(FileError):
        render(tmp_path / "missing.mcap", tmp_path / "x.png", progress=silent)
    obstructions = tmp_path / "o.json"
    obstructions.write_text('{"version": 1, "unit": "m", "obstructions": []}')
    with pytest.raises(InputError, match="has no picture"):
        render(obstructions, tmp_path / "x.png", progress=silent)
    assert silent.seconds == {}
