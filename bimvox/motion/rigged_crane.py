"""A crane with what hangs on its hook: a part, or nothing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bimvox.crane.tower_crane import TowerCrane
from bimvox.motion.load_frame import LoadFrame, load_frame
from bimvox.motion.swing import Pendulum, pendulum_of
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site

HOOK_OFFSET = np.zeros(3, np.int32)
"""The empty hook is one cell at the lower end of its slings."""


class RiggedCrane(NamedTuple):
    """A crane with its load.

    Attributes:
        crane: The crane in the gear of the load, with its slings.
        load: How hook poses and reference cells correspond.
        pendulum: The load as a pendulum; None if its swing is not checked.
        sample_period_s: Largest time between samples of its trajectories.
    """

    crane: TowerCrane
    load: LoadFrame
    pendulum: Pendulum | None
    sample_period_s: float


def rigged_crane(site: Site, crane: TowerCrane, component: Component | None) -> RiggedCrane:
    """Return one of a site's cranes with a component on its hook; with the empty hook (usual slings) if None."""
    rigged = crane_for(site, crane, component)
    line_vox = HOOK_OFFSET if component is None else component.hook_line_vox
    load = load_frame(rigged, site.frame, line_vox)
    return RiggedCrane(rigged, load, pendulum_of(site, crane, component), site.rules.sample_period_s)
