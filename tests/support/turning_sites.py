"""A portal whose loads have room to turn with the jib, and one whose beam does not."""

from __future__ import annotations

from collections.abc import Sequence

from box_sites import box_site, test_crane

from bimvox.site.site import HeadingRule, Rules, Site

PORTAL = [
    ("slab", (7.0, 7.0, 3.4), (11.0, 8.0, 3.6)),
    ("beam", (7.0, 7.4, 3.0), (11.0, 7.6, 3.4)),
    ("left", (7.0, 7.4, 0.0), (7.2, 7.6, 2.98), {"ifc_class": "IfcColumn", "erected": True}),
    ("right", (10.8, 7.4, 0.0), (11.0, 7.6, 2.98), {"ifc_class": "IfcColumn", "erected": True}),
]

BESIDE_THE_PORTAL = [("tower", (8.0, 9.0, 0.0), (10.0, 11.0, 18.0))]
"""A tower within the circle of the beam above its place, and not in the way of the beam that keeps its heading."""


def turning_site(
    heading: HeadingRule = HeadingRule.WITH_JIB,
    *,
    obstructions: Sequence[tuple] = (),
    transit_clearance_m: float = 0.0,
) -> Site:
    """Return the portal under a crane; the jib turns by 42 to 48 degrees with each load."""
    near_rest = {"upending_clearance_m": transit_clearance_m, "turning_clearance_m": transit_clearance_m}
    rules = Rules(heading=heading, transit_clearance_m=transit_clearance_m, **near_rest)
    crane = test_crane(base=(16.0, -4.0, 0.0), jib=40.0, height=26.0)
    yard = ((40, 8), (70, 50))
    return box_site(PORTAL, crane=crane, shape=(90, 60, 40), yard=yard, obstructions=obstructions, rules=rules)
