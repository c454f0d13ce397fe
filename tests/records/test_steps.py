"""What the crane does not lift, in groups: named, weighed, with the times of the work and of material lifts."""

from __future__ import annotations

import dataclasses

import pytest
from box_sites import box_site, test_crane

from bimvox.records.lift import not_lifted
from bimvox.records.steps import NotLifted, Steps, not_lifted_groups
from bimvox.site.casting import FIELD_CASTING
from bimvox.site.means import Means
from bimvox.site.site import Rules, Site

BOX = (0.2, 0.2, 0.5)
"""A box of 48 kg."""


def site_of(count: int, means: Means = Means.BY_HAND, **rules: object) -> Site:
    corners = [(float(n), 0.0, 0.0) for n in range(count)]
    parts = [(f"post {n}", low, tuple(a + b for a, b in zip(low, BOX, strict=True))) for n, low in enumerate(corners)]
    site = box_site(parts, crane=test_crane(base=(10.0, -3.0, 0.0)), rules=Rules(**rules))  # type: ignore[arg-type]
    return dataclasses.replace(
        site,
        components=tuple(
            dataclasses.replace(part, means=means, means_reason="so", storey="Level 2", type_name="Post")
            for part in site.components
        ),
    )


def group_of(site: Site, steps: Steps = Steps()) -> NotLifted:  # noqa: B008 (a frozen value)
    (group,) = not_lifted_groups(site, [not_lifted(part, part.index) for part in site.components], (), steps)
    return group


@pytest.mark.parametrize(("count", "crane_s"), [(6, None), (7, FIELD_CASTING.bundle_s)])
def test_a_bundle_beyond_the_limit_is_a_material_lift(count: int, crane_s: float | None) -> None:
    group = group_of(site_of(count))
    assert group.name == f"bundle: {count} x Post, Level 2"
    assert group.mass_kg == pytest.approx(48.0 * count)
    assert group.crane_s == crane_s
    assert group.to_dict()["material_lift_s"] == crane_s


def test_what_is_cast_is_no_bundle() -> None:
    group = group_of(site_of(20, Means.IN_SITU))
    assert group.name == "cast in place: 20 x Post, Level 2"
    assert group.crane_s is None
