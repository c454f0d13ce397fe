"""The comparison of a log with the files that one holds: whatever differs is named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import sample_models
from bimvox.bim.building import TriangleMesh
from bimvox.grid.labels import Label
from bimvox.library.plan import georeference_of
from bimvox.library.site import LoadedSite, load_site
from bimvox.library.user_files import check_user_files
from bimvox.log.plan_log import GEOREFERENCE, PlanLog
from bimvox.progress import SilentProgress
from bimvox.records.lift import LiftPlan
from bimvox.site.site import HookHeights, Site

SITE = """
name = "bound"
[model]
path = "frame_georeferenced.ifc"
select = "IfcColumn"
voxel_size_m = 0.25
[[zone]]
kind = "limiter"
lowest_hook_m = 1.0
polygon = [[-1, -1], [2, -1], [2, 2], [-1, 2]]
"""


@pytest.fixture(scope="module")
def loaded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, LoadedSite]:
    folder = tmp_path_factory.mktemp("bound")
    model = Path(sample_models.__file__).parent / "frame_georeferenced.ifc"
    (folder / model.name).write_bytes(model.read_bytes())
    (folder / "bound.site.toml").write_text(SITE)
    found = load_site(folder / "bound.site.toml")
    assert any(one.kind == "structure" for one in found.site.blockers)
    return folder / "bound.site.toml", found


def log_of(loaded: LoadedSite, site: Site, **metadata: str) -> PlanLog:
    return PlanLog(LiftPlan(site, ()), attachments=loaded.files, metadata={**georeference_of(loaded), **metadata})


def without_limits(site: Site) -> Site:
    return replace(site, hook_heights=None)


def with_higher_limits(site: Site) -> Site:
    assert site.hook_heights is not None
    return replace(site, hook_heights=HookHeights(site.hook_heights.low_m - 5.0, site.hook_heights.high_m))


def with_a_thinner_structure(site: Site) -> Site:
    at = next(n for n, one in enumerate(site.blockers) if one.kind == "structure")
    mesh = site.blockers[at].mesh
    assert mesh is not None
    thin = TriangleMesh(mesh.vertices_m + np.array([0.0, 0.0, 0.01]), mesh.faces)
    blockers = (*site.blockers[:at], replace(site.blockers[at], mesh=thin), *site.blockers[at + 1 :])
    return replace(site, blockers=blockers)


def with_a_larger_building_area(site: Site) -> Site:
    labels = site.labels.copy()
    labels[-1, -1, 0] = Label.CONSTRUCTION_AREA
    return replace(site, labels=labels)


FORGED: dict[str, tuple[Callable[[Site], Site], str]] = {
    "limits dropped": (without_limits, "zones: the hook's limits are not those of your files"),
    "limits changed": (with_higher_limits, "zones: the hook's limits are not those of your files"),
    "structure": (with_a_thinner_structure, "its surface is not that of your model"),
    "construction area": (with_a_larger_building_area, "areas.construction is not that of your files"),
    "name": (lambda site: replace(site, name="other"), "the name of the site is other in the log, bound in your files"),
    "unit": (
        lambda site: replace(site, source={**site.source, "unit": "inch"}),
        "the model's unit is inch in the log, m in your files",
    ),
    "notes": (
        lambda site: replace(site, notes=("the ground was tested",)),
        "notes is ('the ground was tested',)",
    ),
    "casting": (
        lambda site: replace(site, rules=replace(site.rules, casting=None)),
        "rules.casting is None in the log",
    ),
    "clearances": (
        lambda site: replace(site, rules=replace(site.rules, transit_clearance_m=0.0, gives_way=())),
        "rules.transit_clearance_m is 0.0 in the log, 2.0 in your files",
    ),
}


def test_a_log_of_these_files_is_bound_to_them(loaded: tuple[Path, LoadedSite]):
    path, found = loaded
    check = check_user_files(log_of(found, found.site), path, None, None, SilentProgress())
    assert check.passed, check.failures


@pytest.mark.parametrize("name", FORGED)
def test_what_differs_from_the_files_is_named(loaded: tuple[Path, LoadedSite], name: str):
    path, found = loaded
    forge, says = FORGED[name]
    check = check_user_files(log_of(found, forge(found.site)), path, None, None, SilentProgress())
    assert any(says in failure for failure in check.failures), check.failures


def test_a_georeference_is_that_of_the_model(loaded: tuple[Path, LoadedSite]):
    path, found = loaded
    forged = log_of(found, found.site, **{GEOREFERENCE: '{"crs": "EPSG:25832"}'})
    (failure,) = check_user_files(forged, path, None, None, SilentProgress()).failures
    assert failure.startswith('the model\'s georeference is {"crs": "EPSG:25832"} in the log, ')


def test_only_a_log_of_an_earlier_version_may_lack_what_this_one_writes(loaded: tuple[Path, LoadedSite]):
    path, found = loaded
    rules = replace(found.site.rules, casting=None, transit_clearance_m=0.0, rope_clearance_m=0.0, gives_way=())
    old = log_of(found, replace(found.site, rules=replace(rules, wind_speed_m_s=0.0)))
    check = check_user_files(replace(old, version="0.1.0"), path, None, None, SilentProgress())
    assert check.passed, check.failures
    assert not check_user_files(old, path, None, None, SilentProgress()).passed
