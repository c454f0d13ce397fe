"""What people hand to the library by mistake."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import bimvox

SAMPLES = Path(__file__).parents[2] / "sample_models"


@pytest.fixture(scope="module")
def plan() -> bimvox.Plan:
    return bimvox.plan(bimvox.load_site(SAMPLES / "paper.site.toml"), policy="none")


@pytest.mark.parametrize("value", ["paper.site.toml", None, 3])
def test_a_plan_needs_a_site(value: Any) -> None:
    with pytest.raises(bimvox.BimvoxError, match="takes a site") as caught:
        bimvox.plan(value)
    assert "load_site" in str(caught.value.hint)


@pytest.mark.parametrize("voxel_size_m", [0.0, -1.0, float("nan"), float("inf")])
def test_a_guessed_site_needs_a_cell_size(voxel_size_m: float) -> None:
    building = bimvox.read(SAMPLES / "frame.ifc")
    with pytest.raises(bimvox.BimvoxError, match="voxel_size_m is"):
        bimvox.guess_site(building, voxel_size_m=voxel_size_m)


def test_obstructions_are_a_set_or_a_file(plan: bimvox.Plan) -> None:
    crate = bimvox.Obstruction("crate", bimvox.Box((1, 1, 1), (2, 2, 2)))
    wrong: list[Any] = [[crate], crate, 3]
    for value in wrong:
        with pytest.raises(bimvox.BimvoxError, match="ObstructionSet or the path") as caught:
            bimvox.revise(plan, value)
        assert "ObstructionSet.of" in str(caught.value.hint)


def test_a_plan_says_what_became_of_its_obstructions(plan: bimvox.Plan) -> None:
    far = bimvox.ObstructionSet.of([bimvox.Obstruction("far", bimvox.Box((900, 900, 0), (901, 901, 1)))])
    assert any("far" in note and "outside" in note for note in bimvox.revise(plan, far).notes)
