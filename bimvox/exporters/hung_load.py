"""One lift as mechanics: the crane with its load on rope and slings, masses and inertia, and what drives it.

The hook block is a mass on the rope, the load a box on the slings below it: the pendulum that the plan is made for
(:mod:`bimvox.motion.swing`). Masses of the crane's links are assumed; they carry the motion and do not change it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import joints_of
from bimvox.crane.links import Box, Links, links_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import InputError
from bimvox.log.plan_log import PlanLog
from bimvox.motion.swing import pendulum_on
from bimvox.site.lifting import crane_for, masses_on_rope_kg

_BULK_KG_M3 = {"steel": 500.0, "dark": 500.0, "concrete": 2_400.0, "glass": 100.0}
_LATTICE_KG_M3 = 60.0
"""Assumed: mass of a solid by the volume of its box, with all that is empty in it."""

TINY = (0.01, (1e-4, 1e-4, 1e-4))
"""Mass (kg) and inertia (kg m²) of a link that is a joint alone: the rope, and the slings."""

Vec3 = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Inertia:
    """Mass, its centre in the frame of a link, and its moments about axes through that centre."""

    mass_kg: float
    centre_m: Vec3
    moments_kg_m2: Vec3


@dataclass(frozen=True, slots=True, eq=False)
class HungLoad:
    """A lift from above its place in the yard to its place in the building.

    Attributes:
        name: The part.
        crane: Its crane.
        links: Links, joints and solids of the crane.
        block_kg: What swings at the hook.
        load_kg: What swings below it.
        below_hook_m: From the hook to the middle of the load.
        size_m: Length, width and height of the load, along the site's axes.
        time_s: (N,) from the first sample on.
        joints: (N, 3) slewing (rad), trolley (m) or luffing (rad), rope (m) at these times.
    """

    name: str
    crane: TowerCrane
    links: Links
    block_kg: float
    load_kg: float
    below_hook_m: float
    size_m: Vec3
    time_s: NDArray[np.float64]
    joints: NDArray[np.float64]

    @property
    def load(self) -> Inertia:
        """The load, a solid box, in the frame of the hook."""
        return Inertia(self.load_kg, (0.0, 0.0, -self.below_hook_m), _of_box(self.load_kg, self.size_m))


def hung_load_of(log: PlanLog, orders: Sequence[int]) -> HungLoad:
    """Return the only chosen lift of a log.

    Raises:
        InputError: If it is not one lift, or it has no motion.
    """
    if len(orders) != 1:
        raise InputError(f"{len(orders)} lifts are chosen, and this format is of one", hint="choose it with --lift")
    motion = next((one for one in log.motions if one.order == orders[0]), None)
    site = log.plan.site
    if motion is None:
        raise InputError(f"lift {orders[0] + 1} has no motion", hint="bimvox plan says why it is not planned")
    part = site.components[motion.component]
    if motion.second is not None:
        raise InputError(f"two cranes carry {part.label}, and this format has one", hint="choose another lift")
    crane = crane_for(site, site.cranes[motion.crane], part)
    block_kg, load_kg = masses_on_rope_kg(crane, part)
    low_m, high_m = part.mesh.bounds_m
    size_m = tuple((high_m - low_m).tolist())
    pendulum = pendulum_on(site, crane, part)
    return HungLoad(
        name=part.label,
        crane=crane,
        links=links_of(crane),
        block_kg=block_kg,
        load_kg=load_kg,
        below_hook_m=crane.sling_m + 0.5 * size_m[2] if pendulum is None else pendulum.below_hook_m,
        size_m=size_m,
        time_s=(motion.loaded.time_ns - motion.loaded.time_ns[0]) / 1e9,
        joints=joints_of(crane, motion.loaded.axes),
    )


def inertia_of(boxes: Sequence[Box]) -> Inertia:
    """Return the inertia of a crane's link from its solids; of one without solids, that of ``TINY``."""
    if not boxes:
        return Inertia(TINY[0], (0.0, 0.0, 0.0), TINY[1])
    masses = np.array([_mass_kg(box) for box in boxes])
    centres = np.array([box.centre_m for box in boxes])
    middle = masses @ centres / masses.sum()
    moments = np.array([_of_box(mass, box.size_m) for mass, box in zip(masses.tolist(), boxes, strict=True)])
    apart = (centres - middle) ** 2
    moments += masses[:, None] * (apart.sum(axis=1)[:, None] - apart)
    x, y, z = middle.tolist()
    a, b, c = moments.sum(axis=0).tolist()
    return Inertia(float(masses.sum()), (x, y, z), (a, b, c))


def _mass_kg(box: Box) -> float:
    return float(np.prod(box.size_m)) * (_LATTICE_KG_M3 if box.lattice else _BULK_KG_M3[box.material])


def _of_box(mass_kg: float, size_m: Vec3) -> Vec3:
    a, b, c = (mass_kg / 12.0 * edge**2 for edge in size_m)
    return b + c, a + c, a + b
