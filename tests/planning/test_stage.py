"""What a refusal says about the crane."""

from __future__ import annotations

import dataclasses

from slab_yards import slab_site

from bimvox.crane.gear import Rig
from bimvox.planning.stage import carried_where
from bimvox.site.component import Component, Lifting
from bimvox.units import mass_text

SITE = slab_site()
CRANE = SITE.cranes[0]
MOST_KG = CRANE.chart.capacity_kg[0]


def part_of(mass_kg: float, rig: Rig | None = None) -> Component:
    return dataclasses.replace(SITE.components[0], mass_kg=mass_kg, lifting=Lifting(rig=rig))


def test_the_parts_own_gear_counts_not_the_cranes_usual_rigging() -> None:
    light = Rig("1_leg", 2.0, 10.0, ())
    mass_kg = MOST_KG - CRANE.hook_block_kg - 10.0
    assert CRANE.rigging_mass_kg > 10.0
    assert carried_where(SITE, CRANE, part_of(mass_kg, light)) == (
        f"{CRANE.name} carries {mass_text(MOST_KG)} with rigging and hook block at radii from "
        f"{CRANE.min_radius_m:.1f} to 20.0 m"
    )
    assert carried_where(SITE, CRANE, part_of(mass_kg)).endswith("at no radius")
