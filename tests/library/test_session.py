"""A session as a person types it: values in and out, and files only on request."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray

import bimvox
from bimvox.errors import FileError, InputError, LogFileError, MissingPackageError, NoPlanError

FRAME = Path(__file__).parents[2] / "sample_models" / "frame.ifc"


@pytest.fixture(scope="module")
def site() -> bimvox.LoadedSite:
    return bimvox.guess_site(bimvox.read(FRAME))


@pytest.fixture(scope="module")
def plan(site: bimvox.LoadedSite) -> bimvox.Plan:
    return bimvox.plan(site, policy="none")


def test_a_grid_as_a_dataset_has_the_cells_of_the_grid():
    grid = bimvox.voxelize(bimvox.read(FRAME), 0.5)
    found = grid.to_xarray()
    assert found.labels.shape == grid.shape
    assert int((found.labels != 0).sum()) == sum(n for label, n in grid.counts().items() if label != "air")
    x, y, z = (int(n) for n in np.argwhere(grid.owners.dense() >= 0)[0])
    cell = found.isel(x=x, y=y, z=z)
    np.testing.assert_allclose([cell.x, cell.y, cell.z], grid.frame.centre_of([x, y, z]))
    assert found.part_id[int(cell.owners)] == grid.parts[int(cell.owners)].id
    np.testing.assert_array_equal(found.labels, grid.labels)


def test_a_dataset_can_be_saved_and_has_the_table_of_parts(tmp_path):
    grid = bimvox.voxelize(bimvox.read(FRAME), 0.5)
    grid.to_xarray().to_netcdf(tmp_path / "frame.nc")
    with xarray.open_dataset(tmp_path / "frame.nc") as saved:
        np.testing.assert_array_equal(saved.labels, grid.labels)
        assert saved.part_name.values.tolist() == [part.name for part in grid.parts]
        assert saved.part_mass_kg.values.tolist() == [part.mass_kg for part in grid.parts]
        assert saved.part_storey.values.tolist() == [part.storey or "" for part in grid.parts]
        assert saved.attrs["source_name"] == "frame.ifc"
        assert saved.attrs["source_unit_assumed"] == 0


def test_what_a_notebook_shows_is_one_short_line(site, plan):
    building = bimvox.read(FRAME)
    grid = bimvox.voxelize(building, 0.5)
    lift = plan.lifts[0]
    shown = [building, building.elements[0].mesh, grid, grid.owners, site, site.site, site.components[0]]
    shown += [plan, lift, lift.lift, lift.motion, lift.motion.loaded, plan.verdict, plan.policy, plan.record.plan]
    for value in shown:
        text = repr(value)
        assert len(text) < 200, text
        assert "\n" not in text
    assert repr(building) == "<Building 'frame.ifc': 8 elements, 8 to lift>"
    assert repr(grid) == "<VoxelGrid of 'frame.ifc': 13 x 13 x 7 cells of 0.5 m, 8 parts>"
    assert repr(lift) == f"<Lift 1 of {lift.component.label}: {lift.row.moves} moves by search>"
    assert repr(plan.verdict) == f"<Verification: all {len(plan.verdict.checks)} checks passed>"
    assert len(repr(plan.record)) < 400
    failed = bimvox.Verification((bimvox.Check("swing"), bimvox.Check("capacity", failed=2)))
    assert repr(failed) == "<Verification: failed: capacity>"


def test_an_infeasible_lift_names_what_blocks_it(site):
    target = site.components[0]
    low = site.site.frame.corner_of(np.array(target.target_vox))
    wall = bimvox.Obstruction("wall", bimvox.Box(tuple(low - 0.2), tuple(low + 0.2)))
    plan = bimvox.plan(site, obstructions=bimvox.ObstructionSet.of([wall]), policy="none")
    assert plan.record.attachments.keys() == {"site.toml", "obstructions.json"}
    by_id = {lift.component.id: lift for lift in plan.infeasible}
    assert by_id[target.id].blocked_by == ("wall",)
    assert repr(by_id[target.id]).startswith(f"<Lift {by_id[target.id].number} of {target.label}: infeasible: ")
    assert all(lift.lift.by_other_means for lift in plan.infeasible)
    rules = dataclasses.replace(site.site.rules, by_other_means=False)
    strict = dataclasses.replace(site, site=dataclasses.replace(site.site, rules=rules))
    plan = bimvox.plan(strict, obstructions=bimvox.ObstructionSet.of([wall]), policy="none")
    named = [lift for lift in plan.infeasible if target.id in lift.lift.blocked_by]
    assert named
    assert all(f"{target.name} ({target.id})" in lift.blocked_by == lift.row.blocked_by for lift in named)


def test_a_guessed_site_is_that_of_its_own_site_file(site, tmp_path):
    text = site.to_toml().replace('path = "frame.ifc"', f'path = "{FRAME}"')
    file = tmp_path / "frame.site.toml"
    file.write_text(text)
    loaded = bimvox.load_site(file)
    assert loaded.site.digest == site.site.digest
    assert [part.id for part in loaded.components] == [part.id for part in site.components]


def test_a_plan_is_one_value_with_lifts_motions_and_verdict(plan, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert plan.verified
    assert "8 of 8 lifts planned, verified" in repr(plan)
    assert [lift.number for lift in plan.lifts] == list(range(1, 9))
    for lift in plan.lifts:
        assert lift.path_m is not None
        assert lift.path_m.shape == (len(lift.lift.path_vox), 3)
        assert lift.row.moves == len(lift.path_m) - 1
    assert not plan.infeasible
    assert len(plan.motions) == plan.figures.planned == 8
    table = plan.to_dataframe()
    assert table.number.tolist() == list(range(1, 9))
    assert set(table.method) == {"search"}
    assert not list(tmp_path.iterdir())


def test_a_plan_verified_again_has_the_same_checks(plan):
    verdict = bimvox.verify(plan)
    assert verdict.verified
    assert [check.name for check in verdict.checks] == [check.name for check in plan.verdict.checks]


def test_a_log_gives_the_plan_back(plan, tmp_path):
    log = bimvox.write_log(plan, tmp_path / "frame.mcap")
    again = bimvox.read_log(log)
    assert again.verdict is None
    assert not again.verified
    for one, other in zip(plan.lifts, again.lifts, strict=True):
        assert one.row == other.row
        np.testing.assert_array_equal(one.path_m, other.path_m)
    assert again.record.attachments.keys() == {"site.toml"}
    assert bimvox.verify(log).verified


def test_a_revision_changes_only_what_the_change_meets(plan, tmp_path):
    at_m = plan.lifts[3].path_m[len(plan.lifts[3].path_m) // 2]
    pole = bimvox.Obstruction("pole", bimvox.Box(tuple(at_m), tuple(at_m + 0.2)))
    said: list[str] = []
    revised = bimvox.revise(plan, bimvox.ObstructionSet.of([pole]), progress=said.append)
    assert revised.verified
    assert revised.record.revision == plan.record.revision + 1
    changed = [
        one.number
        for one, before in zip(revised.lifts, plan.lifts, strict=True)
        if not np.array_equal(one.path_m, before.path_m)
    ]
    assert 4 in changed
    assert 0 < len(changed) < 8
    assert "revise" in said
    assert not plan.site.is_obstructed
    from_log = bimvox.revise(
        bimvox.read_log(bimvox.write_log(plan, tmp_path / "a.mcap")), bimvox.ObstructionSet.of([pole])
    )
    assert [lift.row.status for lift in from_log.lifts] == [lift.row.status for lift in revised.lifts]


def test_obstructions_of_a_file_go_into_the_log(plan, tmp_path):
    file = tmp_path / "obstructions.json"
    file.write_text('{"version": 1, "obstructions": [{"id": "a", "box": {"min": [-3, -3, 0], "max": [-2, -2, 1]}}]}')
    revised = bimvox.revise(plan, file)
    assert revised.record.attachments["obstructions.json"] == file.read_bytes()
    assert "sha256 obstructions.json" in revised.record.metadata
    assert bimvox.verify(bimvox.write_log(revised, tmp_path / "b.mcap")).verified
    cleared = bimvox.revise(revised, bimvox.ObstructionSet())
    assert "obstructions.json" not in cleared.record.attachments
    assert bimvox.verify(bimvox.write_log(cleared, tmp_path / "c.mcap")).verified


def test_obstructions_given_as_a_value_go_into_the_log_as_a_file(plan, tmp_path):
    crate = bimvox.Obstruction("crate", bimvox.Box((-3.0, -3.0, 0.0), (-2.0, -2.0, 1.0)))
    log = bimvox.write_log(bimvox.revise(plan, bimvox.ObstructionSet.of([crate])), tmp_path / "a.mcap")
    assert b'"crate"' in bimvox.read_log(log).record.attachments["obstructions.json"]
    assert bimvox.verify(log).verified


def test_pictures_are_written_where_asked(site, plan, tmp_path):
    small = (160, 100)
    assert bimvox.render(plan, tmp_path / "plan.png", lift=4, size_px=small).stat().st_size > 1000
    assert bimvox.render(site, tmp_path / "site.png", size_px=small).read_bytes().startswith(b"\x89PNG")
    assert b"<html" in bimvox.render(plan, tmp_path / "plan.html").read_bytes()
    with pytest.raises(InputError, match="has no lift 9"):
        bimvox.render(plan, tmp_path / "x.png", lift=9)
    with pytest.raises(InputError, match="cannot be drawn"):
        bimvox.render(site, tmp_path / "x.html")
    assert not list(tmp_path.glob("x.*"))


def test_errors_carry_their_evidence(site, tmp_path, monkeypatch, plan):
    with pytest.raises(FileError) as missing:
        bimvox.read(tmp_path / "none.ifc")
    assert missing.value.path == tmp_path / "none.ifc"
    wall = bimvox.Obstruction("wall", bimvox.Box((-100.0, -100.0, 0.0), (100.0, 100.0, 50.0)))
    for reader in (bimvox.verify, bimvox.read_log):
        with pytest.raises(LogFileError, match="no such file") as no_log:
            reader(tmp_path / "none.mcap")
        assert no_log.value.path == tmp_path / "none.mcap"
    with pytest.raises(NoPlanError) as refused:
        bimvox.plan(site, obstructions=bimvox.ObstructionSet.of([wall]), policy="none")
    assert refused.value.reasons.keys() == {part.id for part in site.components}
    begins = [f"no lift can be planned; {part.label}: " for part in site.components]
    assert any(refused.value.message.startswith(words) for words in begins)
    for package in ("pandas", "xarray"):
        monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingPackageError, match="needs the package pandas, which is not installed") as lacking:
        plan.to_dataframe()
    assert lacking.value.package == "pandas"
