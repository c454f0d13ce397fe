"""Every command of docs/pictures.md runs, on a small plan made by hand."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from box_sites import box_mesh
from drawn_plans import motions_by_hand, plan_by_hand

from bimvox.log.plan_log import PlanLog
from bimvox.log.recorder import write_log
from cli.main import run

DOCS = Path(__file__).parents[2] / "docs" / "pictures.md"
COMMANDS = [
    line for block in re.findall(r"^```sh\n(.*?)^```", DOCS.read_text(), re.M | re.S) for line in block.splitlines()
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BIMVOX_SIZE", "120x80")
    plan = plan_by_hand(crane=True, infeasible=("beam-a",))
    with (tmp_path / "prefab.mcap").open("wb") as stream:
        write_log(stream, PlanLog(plan=plan, motions=motions_by_hand(plan)))
    mesh = box_mesh((0, 0, 0), (4, 2, 1))
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices_m.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces.tolist()]
    (tmp_path / "model.obj").write_text("\n".join(lines) + "\n")
    return tmp_path


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_docs_runs(command: str, folder: Path, capsys: pytest.CaptureFixture[str]):
    program, *arguments = shlex.split(command)
    assert program == "bimvox"
    assert run(arguments) == 0, capsys.readouterr().err
    if "-o" in arguments:
        assert (folder / arguments[arguments.index("-o") + 1]).stat().st_size > 0


def test_the_docs_have_commands():
    assert len(COMMANDS) >= 8
