"""Checks of a site file: the access of trucks, and several cranes."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from box_sites import test_crane
from planned_sites import portal_crane, portal_site, rectangle
from slab_yards import slab_site

import bimvox
from bimvox.errors import ConfigError
from bimvox.grid.frame import GridFrame
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.stage import refused_by_crane
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.site.checks import check_access, check_cranes, ground_of, unloading_columns
from bimvox.site.config.file import parse_site_config
from bimvox.site.config.site_config import AreasConfig
from bimvox.site.config.template import site_toml

SITE_FILE = '[model]\npath = "a.ifc"\n[areas]\n'


def read(text):
    return parse_site_config(text if "[areas]" in text else SITE_FILE + text, "a.site.toml")


BOX = ((0.0, 0.0), (10.0, 0.0), (10.0, 8.0), (0.0, 8.0))
STRIP = ((0.0, 6.0), (10.0, 6.0), (10.0, 8.0), (0.0, 8.0))


def test_the_access_is_no_yard():
    frame = GridFrame((0.0, 0.0, -1.0), 1.0)
    yard, access = ground_of(AreasConfig(yard=(BOX,), access=(STRIP,)), frame, (12, 12))
    assert access is not None
    assert (int(yard.sum()), int(access.sum())) == (60, 20)
    assert not (yard & access).any()
    whole, none = ground_of(AreasConfig(yard=(BOX,)), frame, (12, 12))
    assert none is None
    assert int(whole.sum()) == 80


@pytest.mark.parametrize(("width", "good"), [(2.5, False), (2.56, True)])
def test_an_access_is_as_wide_as_a_truck(width: float, good: bool):
    config = read(
        f"access = [[[0, 0], [20, 0], [20, 4], [0, 4]], [[0, 9], [20, 9], [20, {9 + width}], [0, {9 + width}]]]"
    )
    if good:
        check_access(config)
        return
    with pytest.raises(ConfigError, match=r"areas.access\[1\].*2.55 m wide") as caught:
        check_access(config)
    assert caught.value.hint


def test_a_new_site_file_proposes_the_strip_on_the_far_side_of_the_yard():
    text = "construction = [[0, 0], [9, 0], [9, 5], [0, 5]]\nyard = [[[0, -12], [9, -12], [9, -2], [0, -2]]]"
    written = site_toml(read(text))
    line = next(line for line in written.splitlines() if "access" in line)
    assert line.startswith("# access = [[[-4, -16], [12.5, -16], [12.5, -12], [-4, -12]]]")
    assert read(written).areas.access is None
    taken = read(written.replace("# access", "access"))
    assert taken.areas.access is not None
    assert read(site_toml(taken)) == taken


def with_access(*box: float, crane=None, **more):
    site = portal_site(crane or portal_crane(), **more)
    access = rectangle(site, *box)
    return dataclasses.replace(site, access=access, yard=site.yard & ~access)


def test_parts_are_unloaded_where_the_crane_carries_them():
    site = with_access(6.0, 6.0, 20.0, 9.0)
    for part in site.components:
        columns = unloading_columns(site, part)
        assert len(columns)
        assert site.access[tuple(columns.T)].all()
        assert refused_by_crane(site, part) is None
    heavy = dataclasses.replace(site.components[0], mass_kg=1e6)
    assert not len(unloading_columns(site, heavy))


def test_a_plan_keeps_the_access_free_and_is_proven():
    site = slab_site()
    access = np.zeros_like(site.yard)
    access[24:34] = True
    site = dataclasses.replace(site, access=access, yard=site.yard & ~access)
    plan = plan_lifts(site, prepare(site))
    assert verify_plan(plan).verified
    assert all(lift.status is Status.PLANNED and lift.place.cell_vox[0] >= 34 for lift in plan.lifts)


def test_a_part_that_no_truck_brings_within_reach_is_not_planned():
    site = slab_site()
    access = np.zeros_like(site.yard)
    access[-1:] = True
    short = dataclasses.replace(site.cranes[0], jib_length_m=15.0)
    site = dataclasses.replace(site, access=access, yard=site.yard & ~access, cranes=(short,))
    plan = plan_lifts(site, prepare(site))
    assert all(lift.status is Status.INFEASIBLE for lift in plan.lifts)
    assert "cannot be unloaded" in plan.lifts[0].reason
    assert "areas] access" in plan.lifts[0].reason


def test_a_yard_that_is_all_access_is_none(tmp_path):
    box = "[[[0, -20], [10, -20], [10, -9], [0, -9]]]"
    model = (Path(__file__).parents[2] / "sample_models" / "frame.ifc").as_posix()
    site = tmp_path / "a.site.toml"
    site.write_text(f'[model]\npath = "{model}"\n[areas]\nyard = {box}\naccess = {box}\n')
    with pytest.raises(ConfigError, match=r"areas\.yard.*outside construction area and access"):
        bimvox.load_site(site)


CONFIG = parse_site_config('[model]\npath = "m.ifc"\n', "s.toml")
LOW = dataclasses.replace(test_crane(height=20.0), name="low", jib_length_m=20.0)


def beside(x: float, height: float = 20.0, jib: float = 20.0):
    return dataclasses.replace(LOW, name="other", base_m=(x, 0.0, 0.0), jib_height_m=height, jib_length_m=jib)


def check(*cranes):
    check_cranes(CONFIG, cranes, 2.0)


def test_one_crane_and_cranes_far_apart_pass():
    check(LOW)
    check(LOW, beside(30.0))


def test_a_jib_that_would_meet_the_other_mast_is_refused_and_both_are_named():
    with pytest.raises(ConfigError) as caught:
        check(LOW, beside(23.0))
    assert caught.value.key == "crane[0].base_m"
    assert "low" in str(caught.value)
    assert "other" in str(caught.value)


def test_the_upper_jib_may_pass_over_the_lower_crane_but_not_the_lower_meet_the_upper_mast():
    check(LOW, beside(30.0, height=40.0, jib=60.0))
    with pytest.raises(ConfigError) as caught:
        check(LOW, beside(22.0, height=40.0, jib=60.0))
    assert caught.value.key == "crane[0].base_m"
    with pytest.raises(ConfigError) as caught:
        check(LOW, beside(30.0, height=24.0, jib=60.0))
    assert caught.value.key == "crane[1].base_m"


def test_masts_on_one_another_are_refused():
    with pytest.raises(ConfigError) as caught:
        check(LOW, beside(3.0))
    assert "masts of" in str(caught.value) and "low" in str(caught.value)


def test_the_key_of_a_crane_has_its_number_where_there_are_several():
    one, other = ('name = "a"\nbase_m = [0, 0]\n', 'name = "b"\nbase_m = [90, 0]\n')
    assert read(f"[crane]\n{one}").crane_key(0) == "crane.base_m"
    assert read(f"[[crane]]\n{one}[[crane]]\n{other}").crane_key(1) == "crane[1].base_m"
    moves = '[crane]\nmachine = "mobile-60t"\n' + f"[[crane.setup]]\n{one}[[crane.setup]]\n{other}"
    assert read(moves).crane_key(1, "jib") == "crane.setup[1].boom_m"
    assert read(moves).crane_key(1, "machine") == "crane.machine"
