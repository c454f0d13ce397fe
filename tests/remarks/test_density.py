"""Remarks on parts that are too light or too heavy for what they enclose."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from remarked_plans import named, of_kind, plan_of

from bimvox.bim.building import TriangleMesh
from bimvox.records.lift import LiftPlan
from bimvox.records.remark import Severity


def weighing(mass_kg: float, *, is_open: bool = False) -> LiftPlan:
    """A plan of one part of 2 m3."""
    plan = plan_of([("part", (1.0, 1.0, 0.0), (3.0, 2.0, 1.0))])
    (part,) = plan.site.components
    mesh = TriangleMesh(part.mesh.vertices_m, np.delete(part.mesh.faces, 0, axis=0)) if is_open else part.mesh
    site = dataclasses.replace(plan.site, components=(dataclasses.replace(part, mass_kg=mass_kg, mesh=mesh),))
    return dataclasses.replace(plan, site=site)


@pytest.mark.parametrize("kg_m3", [80.0, 420.0, 2500.0, 7850.0, 8900.0])
def test_what_is_built_with_is_not_odd(kg_m3: float) -> None:
    assert not named(weighing(2.0 * kg_m3), "density")


@pytest.mark.parametrize(
    ("kg_m3", "severity", "says"),
    [
        (7.85, Severity.SERIOUS, "weighs 16 kg, 8 kg/m3 of what it encloses: lighter than a building part"),
        (40.0, Severity.MINOR, "weighs 80 kg, 40 kg/m3 of what it encloses: lighter than a building part"),
        (11_300.0, Severity.MINOR, "weighs 22.6 t, 11,300 kg/m3 of what it encloses: denser than steel"),
        (19_300.0, Severity.SERIOUS, "weighs 38.6 t, 19,300 kg/m3 of what it encloses: denser than steel"),
    ],
)
def test_an_odd_density_is_remarked(kg_m3: float, severity: Severity, says: str) -> None:
    (remark,) = of_kind(weighing(2.0 * kg_m3), "density")
    assert remark.severity is severity
    assert remark.component == "part"
    assert remark.text.startswith(says)


def test_nothing_is_said_of_an_open_mesh() -> None:
    assert not named(weighing(20.0, is_open=True), "density")
