"""Small sites with a panel that is turned over in the air between two hooks."""

from __future__ import annotations

from dataclasses import replace

from box_sites import box_site, test_crane

from bimvox.crane.auxiliary import Auxiliary
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.default_rules import FlipRules
from bimvox.site.site import Rules, Site

AUXILIARY = Auxiliary(LoadChart((1000.0,), (9_000.0,)), hook_block_kg=150.0, ahead_m=1.0, fitted=True)
_RULES = FlipRules()


def crane_with(auxiliary: Auxiliary | None = AUXILIARY, most_kg: float = 20_000.0) -> TowerCrane:
    """Return a crane with this auxiliary hook."""
    crane = test_crane(base=(13.0, 13.0, 0.0))
    return replace(crane, auxiliary=auxiliary, chart=LoadChart((2.0, 20.0, 60.0), (most_kg, most_kg, 0.9 * most_kg)))


def flipping_site(
    *, crane: TowerCrane | None = None, thick_m: float = 0.5, rules: FlipRules = _RULES, **part: object
) -> Site:
    """Return a site with one panel, 6 m high, 1 m wide, which weighs 7.2 t."""
    panel = ("panel", (2.0, 2.0, 0.0), (2.0 + thick_m, 3.0, 6.0), {"erected": True, "flip_rise_vox": 2, **part})
    return box_site(
        [panel],
        yard=((24.0, 4.0), (40.0, 28.0)),
        crane=crane or crane_with(),
        shape=(44, 30, 28),
        rules=Rules(two_hooks=rules),
    )
