"""Road, gear and crane agree on what is lifted in one piece."""

from __future__ import annotations

from dataclasses import replace

import pytest
from box_buildings import box_element

from bimvox.bim.building import Casting
from bimvox.site.config.crane import CraneConfig
from bimvox.site.config.site_config import ModelConfig, SiteConfig
from bimvox.site.demand import means_by
from bimvox.site.means import Means

HEAVY = {
    "long floor": box_element("part", (0, 0, 3), (34, 3, 3.25), ifc_class="IfcSlab"),
    "thick wall": box_element("part", (0, 0, 0), (12, 0.6, 3.9), ifc_class="IfcWall"),
    "block": box_element("part", (0, 0, 0), (4, 2, 3.5), ifc_class="IfcBuildingElementProxy"),
}
SITE = SiteConfig(model=ModelConfig(path="a.ifc"))


@pytest.mark.parametrize("name", sorted(HEAVY))
def test_concrete_that_goes_by_road_but_that_nothing_lifts_is_cast_in_place(name):
    part = HEAVY[name]
    found = means_by(SITE, [part], {})["part"]
    assert found.means is Means.IN_SITU
    assert "that nothing lifts in one piece" in found.why
    assert means_by(SITE, [replace(part, casting=Casting.PRECAST)], {})["part"].means is Means.CRANE


def test_a_crane_with_rigging_of_its_own_is_not_asked_for_gear():
    own = CraneConfig(machine="flat-top-800", base_m=(0.0, -20.0, 0.0), sling_m=4.0, rigging_mass_kg=500.0)
    assert means_by(SITE.model_copy(update={"crane": own}), [HEAVY["block"]], {})["part"].means is Means.CRANE
