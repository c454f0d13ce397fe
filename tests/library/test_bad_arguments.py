"""Wrong arguments that people give to the library."""

from __future__ import annotations

from dataclasses import replace
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


@pytest.mark.parametrize(("name", "least"), [("seed", 0), ("steps", 1), ("retrain", 0)])
def test_a_number_out_of_range_is_refused(plan: bimvox.Plan, name: str, least: int) -> None:
    site = bimvox.load_site(SAMPLES / "paper.site.toml")
    options: dict[str, Any] = {name: least - 1}
    with pytest.raises(bimvox.errors.InputError, match=f"{name} is {least - 1}") as caught:
        bimvox.plan(site, policy="none", **options)
    assert caught.value.hint == f"give {least} or more"


@pytest.fixture(scope="module")
def building() -> bimvox.Building:
    return bimvox.read(SAMPLES / "frame.ifc")


def test_an_argument_of_another_kind_is_refused_with_a_sentence_and_a_hint(
    plan: bimvox.Plan, building: bimvox.Building, tmp_path: Path
) -> None:
    site, png = bimvox.load_site(SAMPLES / "paper.site.toml"), tmp_path / "x.png"
    verbs: Any = bimvox
    wrong = {
        r"^read\(\) takes the path of a file, not an int": lambda: verbs.read(5),
        r"^voxelize\(\) takes a building, not a str": lambda: verbs.voxelize("frame.ifc"),
        r"^voxel_size_m is '0.25'": lambda: verbs.voxelize(building, "0.25"),
        r"^voxel_size_m is -1": lambda: verbs.voxelize(building, -1),
        r"^threads is 0": lambda: verbs.voxelize(building, 1.0, threads=0),
        r"^load_site\(\) takes the path of a site file, not a Building": lambda: verbs.load_site(building),
        r"^guess_site\(\) takes a building, not a str": lambda: verbs.guess_site("frame.ifc"),
        r"^crane is 5": lambda: verbs.guess_site(building, crane=5),
        r"^seed is 'a'": lambda: verbs.plan(site, seed="a"),
        r"^policy is 5": lambda: verbs.plan(site, policy=5),
        r"^progress is 5": lambda: verbs.plan(site, progress=5),
        r"^revise\(\) takes a plan, not a LoadedSite": lambda: verbs.revise(site, bimvox.ObstructionSet.of([])),
        r"^obstructions are an ObstructionSet or the path": lambda: verbs.revise(plan, None),
        r"^verify\(\) takes the path of a log, or a plan, not a LoadedSite": lambda: verbs.verify(site),
        r"^render\(\) takes a plan, a site or a grid, not a Building": lambda: verbs.render(building, png),
        r"^export\(\) takes a plan, a grid or the path of a log, not a LoadedSite": lambda: verbs.export(site, png),
        r"x.png: no format has this suffix": lambda: verbs.export(plan, png),
        r"^to is 'xls'": lambda: verbs.export(plan, png, to="xls"),
        r"^there is no lift 99": lambda: verbs.export(plan, png, to="csv", lifts=[99]),
        r"^a grid has no lifts": lambda: verbs.export(verbs.voxelize(building, 1.0), png, lifts=[1]),
        r"^the ifc format adds": lambda: verbs.export(plan, tmp_path / "x.ifc"),
        r"^size_px is 640": lambda: verbs.render(plan, png, size_px=640),
        r"^size_px is \(0, 0\)": lambda: verbs.render(plan, png, size_px=(0, 0)),
        r"^lift is '3'": lambda: verbs.render(plan, png, lift="3"),
        r"^write_log\(\) takes a plan, not a PosixPath": lambda: verbs.write_log(tmp_path / "x.mcap", plan),
        r"^write_log\(\) takes the path of a file, not a Plan": lambda: verbs.write_log(plan, plan),
        r"^read_log\(\) takes the path of a log, not a Plan": lambda: verbs.read_log(plan),
    }
    for said, call in wrong.items():
        with pytest.raises(bimvox.BimvoxError, match=said) as caught:
            call()
        assert caught.value.hint, said
    assert not list(tmp_path.iterdir())


def test_a_log_has_the_name_of_a_log(plan: bimvox.Plan, tmp_path: Path) -> None:
    with pytest.raises(bimvox.errors.InputError, match="a log is an MCAP file") as caught:
        bimvox.write_log(plan, tmp_path / "plan.txt")
    assert caught.value.hint == "name it plan.mcap"
    assert not list(tmp_path.iterdir())


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


def test_values_that_make_no_sense_are_not_drawn(plan: bimvox.Plan, tmp_path: Path) -> None:
    site = plan.site
    parts = (replace(site.components[0], mass_kg=float("nan")), *site.components[1:])
    record = replace(plan.record, plan=replace(plan.record.plan, site=replace(site, components=parts)))
    for name in ("x.html", "x.png", "x.gif"):
        with pytest.raises(bimvox.errors.InputError, match="values of the plan make no sense"):
            bimvox.render(replace(plan, record=record), tmp_path / name)
    assert not list(tmp_path.iterdir())
