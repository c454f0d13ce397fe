"""The smallest wind in which parts may be lifted, and what governs it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from box_sites import box_site, test_crane

from bimvox.site.lifting import governing_wind

PARTS = [("heavy", (1.0, 1.0, 0.0), (2.0, 2.0, 1.0)), ("sheet", (4.0, 1.0, 0.0), (4.1, 3.0, 2.0))]


@pytest.mark.parametrize(("name", "says"), [("Sheet 7", "Sheet 7"), ("", "sheet")])
def test_the_part_that_permits_least_is_named_or_has_its_id(name: str, says: str):
    site = box_site(PARTS, crane=test_crane())
    heavy, sheet = site.components
    found = governing_wind(site, [replace(heavy, sail_area_m2=1.0), replace(sheet, sail_area_m2=40.0, name=name)])
    assert found is not None
    assert (found.component, found.name) == ("sheet", says)
    assert found.speed_m_s < site.cranes[0].max_wind_m_s


def test_where_every_part_permits_more_the_crane_governs():
    site = box_site(PARTS, crane=test_crane())
    found = governing_wind(site, [replace(part, sail_area_m2=0.01) for part in site.components])
    assert found is not None
    assert (found.component, found.name, found.speed_m_s) == (None, "test", site.cranes[0].max_wind_m_s)
    assert governing_wind(site, []) is None
    assert governing_wind(box_site(PARTS), site.components) is None
