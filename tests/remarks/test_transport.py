"""Remarks on parts by transport: a lorry, a special transport, a person or a bundle."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from remarked_plans import named, of_kind, plan_of

from bimvox.records.lift import LiftPlan
from bimvox.records.remark import Severity


def part_of(size: tuple[float, float, float], mass_kg: float = 1000.0) -> LiftPlan:
    x, y, z = size
    plan = plan_of([("part", (1.0, 1.0, 0.0), (1.0 + x, 1.0 + y, z))], shape=(140, 40, 40))
    (component,) = plan.site.components
    site = dataclasses.replace(plan.site, components=(dataclasses.replace(component, mass_kg=mass_kg),))
    return dataclasses.replace(plan, site=site)


@pytest.mark.parametrize(
    ("size", "mass_kg"),
    [((12.0, 2.4, 0.3), 24_000.0), ((0.4, 0.4, 13.0), 5000.0), ((6.0, 0.2, 3.6), 9000.0), ((8.0, 3.5, 0.3), 20_000.0)],
    ids=["slab", "column", "panel", "panel drawn flat"],
)
def test_ordinary_precast_parts_go_by_lorry(size: tuple[float, float, float], mass_kg: float) -> None:
    assert not named(part_of(size, mass_kg), "transport")


@pytest.mark.parametrize(
    ("size", "mass_kg", "said"),
    [
        ((20.0, 0.5, 1.2), 20_000.0, "is 20.0 m long (a lorry takes 13.6 m)"),
        ((8.0, 4.2, 0.3), 20_000.0, "is 4.2 m wide (a lorry takes 3.0 m)"),
        ((4.0, 3.0, 2.9), 20_000.0, "is 2.9 m high (a lorry takes 2.8 m)"),
        ((10.0, 1.0, 1.0), 30_000.0, "weighs 30.0 t (a lorry carries 24.0 t)"),
    ],
)
def test_what_needs_a_permit_is_minor(size: tuple[float, float, float], mass_kg: float, said: str) -> None:
    (remark,) = of_kind(part_of(size, mass_kg), "transport")
    assert remark.severity is Severity.MINOR
    assert said in remark.text
    assert remark.text.endswith("a special transport with a permit")


@pytest.mark.parametrize(
    ("size", "mass_kg"),
    [((10.0, 8.0, 0.3), 60_000.0), ((42.0, 1.0, 2.0), 69_000.0), ((10.0, 4.0, 0.3), 145_800.0), ((5.0, 5.0, 4.2), 9e3)],
    ids=["wide", "long", "cast in place", "high"],
)
def test_what_cannot_go_by_road_is_serious(size: tuple[float, float, float], mass_kg: float) -> None:
    (remark,) = of_kind(part_of(size, mass_kg), "transport")
    assert remark.severity is Severity.SERIOUS
    assert remark.text.endswith("it cannot go by road in one piece")


def test_a_part_turned_on_plan_is_measured_along_itself() -> None:
    plan = part_of((12.0, 1.0, 1.0), 20_000.0)
    (component,) = plan.site.components
    x, y, z = component.mesh.vertices_m.T
    vertices = component.mesh.vertices_m.copy()
    vertices[:, 0], vertices[:, 1], vertices[:, 2] = 0.6 * x - 0.8 * y + 5.0, 0.8 * x + 0.6 * y, z
    turned = dataclasses.replace(component, mesh=dataclasses.replace(component.mesh, vertices_m=vertices))
    site = dataclasses.replace(plan.site, components=(turned,))
    assert not named(dataclasses.replace(plan, site=site), "transport")


def test_a_brace_is_laid_flat_on_a_lorry() -> None:
    plan = part_of((8.0, 0.1, 0.1))
    (component,) = plan.site.components
    x, y, z = component.mesh.vertices_m.T
    vertices = np.stack([0.6 * x - 0.8 * z, y, 0.8 * x + 0.6 * z], axis=1)
    brace = dataclasses.replace(component, mesh=dataclasses.replace(component.mesh, vertices_m=vertices))
    site = dataclasses.replace(plan.site, components=(brace,))
    assert not named(dataclasses.replace(plan, site=site), "transport")


@pytest.mark.parametrize(
    ("mass_kg", "said"),
    [(21.0, "one person carries that"), (25.0, "one person carries that"), (70.0, "by the bundle"), (76.0, None)],
)
def test_what_a_person_carries_needs_no_separate_lift(mass_kg: float, said: str | None) -> None:
    found = of_kind(part_of((1.0, 0.2, 0.1), mass_kg), "hand_load")
    assert len(found) == (said is not None)
    assert all(said in remark.text and remark.severity is Severity.MINOR for remark in found if said)
