"""Deliveries exported as sites of their own: planned and proven like any other, their ends are those of the plan."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.validate
import numpy as np
import pytest
from bimvox_pipeline.export import export
from bimvox_pipeline.plan import plan
from bimvox_pipeline.site import init

from bimvox.bim.building import TriangleMesh
from bimvox.errors import InputError
from bimvox.exporters.unloading import TRUCK_HEIGHT_M, Body, delivery_sites, model_ifc
from bimvox.library.arguments import PolicyWish
from bimvox.library.site import load_site
from bimvox.library.verify import verify
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress
from bimvox.site.component import StoredPose
from bimvox.site.config.site_config import ModelConfig, SiteConfig

SAMPLES = Path(__file__).parents[3] / "sample_models"
SEARCH = PolicyWish(policy="none")


def planned_with_access(folder: Path, model: str) -> PlanLog:
    """Plan a sample with the access that ``init`` gives; the log is ``plan.mcap``."""
    site = folder / "with.site.toml"
    init(SAMPLES / model, out=site, progress=SilentProgress())
    assert "\naccess = " in site.read_text()
    plan(site, folder / "plan.mcap", wish=SEARCH, progress=SilentProgress())
    return read_log(folder / "plan.mcap")


def unloading(folder: Path) -> dict[str, Any]:
    return export(folder / "plan.mcap", to="unloading", out=folder / "unloading", progress=SilentProgress())


def proven_unloading(folder: Path, site_file: Path) -> PlanLog:
    log = folder / f"{site_file.stem}.mcap"
    plan(site_file, log, wish=SEARCH, progress=SilentProgress())
    assert verify(log).verified
    return read_log(log)


def check_delivery(main: PlanLog, own: PlanLog, number: int) -> None:
    """Check that a delivery brings its parts from the truck to their places, the last one needed first."""
    site = own.plan.site
    load = [lift for lift in main.plan.lifts if lift.in_yard and lift.in_yard.delivery == number]
    wanted = [main.plan.site.components[lift.component].id for lift in reversed(load)]
    assert [site.components[lift.component].id for lift in own.plan.lifts] == wanted
    for lift, before in zip(own.plan.lifts, reversed(load), strict=True):
        component, stored = site.components[lift.component], before.in_yard
        place = lift.place
        assert lift.path_vox is not None
        assert stored is not None
        assert place is not None
        on_truck = place.shape.cells + np.array(place.cell_vox)
        assert site.frame.corner_of(on_truck.min(axis=0))[2] >= TRUCK_HEIGHT_M
        assert main.plan.site.access is not None
        assert main.plan.site.access[tuple(on_truck[:, :2].T)].all()
        cells = component.shape.cells + lift.path_vox[-1]
        expected = stored.shape.cells + np.array(stored.cell_vox)
        assert set(map(tuple, cells[:, :2].tolist())) == set(map(tuple, expected[:, :2].tolist()))
        assert int(cells[:, 2].min()) <= int(expected[:, 2].min())  # a bearer reaches down
        mass_kg = main.plan.site.components[before.component].mass_kg
        assert component.mass_kg == pytest.approx(mass_kg)


@pytest.mark.slow
def test_every_delivery_of_a_plan_is_a_site_that_plans_and_is_proven(tmp_path: Path) -> None:
    main = planned_with_access(tmp_path, "frame.ifc")
    document = unloading(tmp_path)
    sites = sorted((tmp_path / "unloading").glob("*.site.toml"), key=lambda path: int(path.stem[:-5].split("-")[-1]))
    assert sites
    access = tomllib.loads((tmp_path / "with.site.toml").read_text())["areas"]["access"]
    parts = 0
    for number, site_file in enumerate(sites):
        own = proven_unloading(tmp_path, site_file)
        check_delivery(main, own, number)
        parts += len(own.plan.lifts)
        assert tomllib.loads(site_file.read_text())["areas"]["yard"] == access
    assert document["lifts"] == document["messages"] == parts
    standing = {one.id for one in load_site(sites[-1]).site.blockers if one.kind == "structure"}
    assert len(standing) >= sum(lift.is_set for lift in main.plan.lifts) - len(own.plan.lifts)


@pytest.mark.slow
def test_stacks_racks_and_columns_are_unloaded(tmp_path: Path) -> None:
    main = planned_with_access(tmp_path, "prefab.ifc")
    unloading(tmp_path)
    places = [place for lift in main.plan.lifts if (place := lift.in_yard) is not None]
    stack = next(place.delivery for place in places if place.stack)
    rack = next(place.delivery for place in places if place.rack)
    lying = next(place.delivery for place in places if place.pose is not StoredPose.AS_BUILT)
    for number in sorted({stack, rack, lying}):
        (site_file,) = (tmp_path / "unloading").glob(f"*-delivery-{number + 1}.site.toml")
        check_delivery(main, proven_unloading(tmp_path, site_file), number)


def test_a_site_without_access_says_what_to_do(site_folder: Path) -> None:
    log = read_log(site_folder / "frame.mcap")
    bare = replace(log, plan=replace(log.plan, site=replace(log.plan.site, access=None)))
    with pytest.raises(InputError, match="no access of trucks") as raised:
        delivery_sites(bare, SiteConfig(model=ModelConfig(path=Path("frame.ifc"))))
    assert "[areas] access" in str(raised.value.hint)
    with pytest.raises(InputError, match="of a whole log"):
        export(
            site_folder / "frame.mcap", to="unloading", out=site_folder / "x", lifts=["1"], progress=SilentProgress()
        )


def test_the_model_is_valid_and_the_same_bytes_again(tmp_path: Path) -> None:
    planned_with_access(tmp_path, "frame.ifc")
    unloading(tmp_path)
    first = {path.name: path.read_bytes() for path in (tmp_path / "unloading").iterdir()}
    export(tmp_path / "plan.mcap", to="unloading", out=tmp_path / "again", progress=SilentProgress())
    assert first == {path.name: path.read_bytes() for path in (tmp_path / "again").iterdir()}
    for name in first:
        if name.endswith(".ifc"):
            logger = ifcopenshell.validate.json_logger()
            ifcopenshell.validate.validate(ifcopenshell.open(tmp_path / "again" / name), logger)
            assert logger.statements == []


def test_a_body_without_a_class_of_ifc4_is_a_proxy() -> None:
    mesh = TriangleMesh(np.eye(3), np.array([[0, 1, 2]], np.int32))
    bodies = [Body("a body", "a body", "Mesh", mesh, 10.0), Body("b", "b", "IfcBearing", mesh, 20.0)]
    file = ifcopenshell.file.from_string(model_ifc("two", bodies).decode())
    assert {product.is_a() for product in file.by_type("IfcElement")} == {"IfcBuildingElementProxy"}
    assert len({product.GlobalId for product in file.by_type("IfcRoot")}) == len(file.by_type("IfcRoot"))
