"""Every command in the docs runs, document by document as a reader would run it; every inline command exists."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import typer
from bimvox_cli.main import app, run
from box_sites import box_mesh
from doc_commands import DOCUMENTS, ROOT, blocks, commands, name_of, run_commands, text_of
from drawn_plans import motions_by_hand, plan_by_hand

from bimvox.log.plan_log import PlanLog
from bimvox.log.recorder import write_log
from bimvox.site.obstructions.file import parse_obstructions
from docs.reference.__main__ import pages
from docs.reference.examples import EXAMPLES

AN_OBSTRUCTION = re.search(r"^```json\n(.*?)^```", (ROOT / "docs" / "tutorial.md").read_text(), re.M | re.S)


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the sample frame: site file, log and grid."""
    folder = tmp_path_factory.mktemp("planned")
    shutil.copytree(
        ROOT / "sample_models", folder / "sample_models", ignore=shutil.ignore_patterns("*.py", "__pycache__")
    )
    site = folder / "frame.site.toml"
    for arguments in (
        ["init", folder / "sample_models" / "frame.ifc", "-o", site],
        ["plan", site, "-o", folder / "frame.mcap"],
        ["voxelize", folder / "sample_models" / "frame.ifc", "-o", folder / "frame.zarr.zip"],
    ):
        assert run([str(word) for word in [*arguments, "-q"]]) == 0
    assert AN_OBSTRUCTION is not None
    obstruction = json.loads(AN_OBSTRUCTION.group(1))
    obstruction["obstructions"][0]["box"] = {"min": [-3.0, -3.0, 0.0], "max": [-2.0, -2.0, 1.0]}
    (folder / "obstructions.json").write_text(json.dumps(obstruction))
    (folder / "ltx-1060.csv").write_text("name: LTX 1060\nR m;18 m;30 m\n6;20.4 t;14.4\n10;10.4;10.4\n")
    (folder / "sweep.toml").write_text('sites = ["frame.site.toml"]\npolicy = "none"\n')
    return folder


def _sample(planned: Path, folder: Path) -> None:
    shutil.copytree(planned, folder, dirs_exist_ok=True)


def _own_building(planned: Path, folder: Path) -> None:
    shutil.copy(planned / "sample_models" / "frame.ifc", folder / "building.ifc")
    shutil.copy(planned / "obstructions.json", folder)


def _drawn_plan(planned: Path, folder: Path) -> None:
    """Write a hand-made plan with an infeasible part, and a mesh."""
    plan = plan_by_hand(crane=True, infeasible=("beam-a",))
    with (folder / "prefab.mcap").open("wb") as stream:
        write_log(stream, PlanLog(plan=plan, motions=motions_by_hand(plan)))
    mesh = box_mesh((0, 0, 0), (4, 2, 1))
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices_m.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces.tolist()]
    (folder / "model.obj").write_text("\n".join(lines) + "\n")


SETTINGS: dict[str, Callable[[Path, Path], None]] = {
    "README.md": _own_building,
    "docs/pictures.md": _drawn_plan,
    **{f"docs/commands/{name}.md": _sample for name, run in EXAMPLES.items() if run},
}

TAKES_LONG = (
    "README.md",
    "docs/pictures.md",
    "docs/commands/experiment.md",
    "docs/commands/sweep.md",
    "docs/commands/train.md",
)
MARKS = dict.fromkeys(TAKES_LONG, pytest.mark.slow)


def every_name() -> list[str]:
    return [*map(name_of, DOCUMENTS), *(f"docs/{page}" for page in pages())]


def test_every_document_with_commands_is_run():
    # The tutorial has its own test file, because it takes longest.
    assert {name for name in every_name() if commands(name)} == {*SETTINGS, "docs/tutorial.md"}
    assert sum(len(commands(name)) for name in SETTINGS) > 40


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param(one, marks=MARKS.get(one, ())) for one in SETTINGS])
def test_the_commands_of_a_document_run(
    name: str, planned: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    SETTINGS[name](planned, tmp_path)
    monkeypatch.chdir(tmp_path)
    if name == "docs/pictures.md":
        monkeypatch.setenv("BIMVOX_SIZE", "120x80")
    if name == "docs/commands/demo.md":
        frame = (tmp_path / "sample_models" / "frame.ifc").read_bytes()
        monkeypatch.setattr("bimvox_pipeline.demo.sample", lambda: frame)
    run_commands(name, tmp_path, capsys)


def test_the_tutorials_obstruction_file_is_one(tmp_path: Path):
    assert AN_OBSTRUCTION is not None
    found = parse_obstructions(AN_OBSTRUCTION.group(1).encode(), "obstructions.json", tmp_path)
    assert [one.id for one in found.obstructions] == ["truck-7"]


@pytest.mark.parametrize("name", [name_of(file) for file in DOCUMENTS if blocks(name_of(file), "python")])
def test_the_python_of_the_docs_runs(name: str, planned: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The blocks of a document run one after the other, like the cells of a notebook."""
    shutil.copytree(planned, tmp_path, dirs_exist_ok=True)
    shutil.copy(planned / "frame.zarr.zip", tmp_path / "tower.zarr.zip")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for block in blocks(name, "python"):
        exec(compile(block, name, "exec"), names)


TRAININGS = (ROOT / "docs" / "start" / "trainings.py").read_text("utf-8")


@pytest.mark.slow
def test_the_trainings_for_researchers_learn(capsys: pytest.CaptureFixture[str]):
    exec(compile(TRAININGS, "trainings.py", "exec"), {})
    said = dict(line.rsplit(" ", 1) for line in capsys.readouterr().out.splitlines())
    assert list(said) == ["paper's site", "lift", "paper's site, torch alone"]
    assert all(float(success) >= 0.9 for success in said.values())


INLINE = re.compile(r"`((?:bimvox|make) [^`]+)`")
SHOWN = re.compile(r"^(bimvox [^#\n]+?)(?: +#.*)?$", re.M)
"""A command in a block that is shown and not run."""


def test_every_inline_command_exists():
    base: Any = typer.main.get_command(app)
    context = base.context_class(base, info_name="bimvox")
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.M))
    checked = 0
    for name in every_name():
        shown = [line for block in blocks(name, "bash") for line in SHOWN.findall(block)]
        for line in [*INLINE.findall(text_of(name)), *shown]:
            words = re.sub(r"\s+", " ", line).split(" ")
            if words[0] == "make":
                assert words[1] in targets, f"{name}: {line}"
                checked += 1
                continue
            for choice in words[1].split("|"):
                if not re.fullmatch(r"[a-z]+", choice):
                    continue
                command = base.get_command(context, choice)
                assert command is not None, f"{name}: {line}"
                rest = words[2:]
                if rest and rest[0] in getattr(command, "commands", {}):
                    command = command.get_command(context, rest[0])
                known = {
                    option for parameter in command.params for option in [*parameter.opts, *parameter.secondary_opts]
                }
                for option in re.findall(r"(?<=[ \[])--?[a-z][a-z-]*", " ".join(rest)):
                    assert option in known | {"-h", "--help"}, f"{name}: {line}"
                checked += 1
    assert checked > 30
