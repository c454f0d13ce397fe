"""How high loads are carried over the ground and what stands, and how much of its capacity the crane uses."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.densities import density_of_kind
from bimvox.bim.kinds.kind import Confidence, Kind
from bimvox.bim.mass_uncertainty import ASSUMED
from bimvox.compiled import kernel
from bimvox.crane.tower_crane import TowerCrane
from bimvox.motion.swept import cells_of_axes, load_frame
from bimvox.proof.crane.capacity import shares_of_capacity
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.remark import Remark, Severity
from bimvox.remarks.subject import Subject, about, metres, name_of, tonnes
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for, hung_kg
from bimvox.site.site import Site

CARRIED_LOW = "carried_low"
HIGH_UTILISATION = "high_utilisation"
DOUBTFUL_MASS = "doubtful_mass"

CARRYING_HEIGHT_M = 2.0
"""Least height over people and finished work: 2 to 3 m are usual in lift plans (professional judgement)."""
HIGH_SHARE = 0.9
"""Above this share of the capacity a lift is close to the limit: many contractors permit 80 to 90 % (professional
judgement; 29 CFR 1926.751 calls lifts from 75 % on critical)."""
DOUBTFUL_SHARE = 0.8
"""Above this share of the capacity, a mass that may be 25 % too low overloads the crane."""

_LIGHT = (Kind.TIMBER, Kind.LIGHT)
_ROUNDING_M = 0.051
_FAR_M = 10.0
_FREE = np.int32(2**31 - 1)


def carried_low(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every load that is carried over something with less than 2 m between them.

    The load counts while it travels, from the start of slewing or trolleying until it is only lowered. Parts that wait
    in the yard do not count, and neither do masts, which no load passes over.
    """
    for component, gap_m, below in _heights(subject, CARRYING_HEIGHT_M):
        if gap_m < CARRYING_HEIGHT_M - _ROUNDING_M:
            said = f"is carried {metres(max(gap_m, 0.0))} over {below}: {metres(CARRYING_HEIGHT_M)} are usual"
            yield about(component, CARRIED_LOW, Severity.MINOR, said)


def least_height_m(subject: Subject) -> tuple[float, str, str] | None:
    """Return how low a load is carried at the lowest: the height, its part's name, and over what.

    It is measured as for ``carried_low``. None without a crane, or if every load is carried higher than 10 m.
    """
    heights = [(gap_m, name_of(component), below) for component, gap_m, below in _heights(subject, _FAR_M)]
    found = min(heights, default=(_FAR_M, "", ""))
    return (max(found[0], 0.0), *found[1:]) if found[0] < _FAR_M else None


def _heights(subject: Subject, most_m: float) -> Iterator[tuple[Component, float, str]]:
    """Yield every load, its least height over something while it travels, at most ``most_m``, and over what that is."""
    site = subject.site
    if not (subject.motions and site.cranes):
        return
    since = _since(subject)
    names = {lift.order: name_of(site.components[lift.component]) for lift in subject.lifts}
    for number, blocker in enumerate(site.blockers):
        names[-1 - number] = "the ground" if blocker.kind == "ground" else blocker.name or blocker.id
    reach = int(np.ceil(most_m / site.frame.voxel_size_m))
    for motion in subject.motions:
        component = site.components[motion.component]
        gap, below = _least_gap(since, _travelled(site, component, motion), _feet(component), motion.order, reach)
        yield component, float(gap) * site.frame.voxel_size_m, names.get(below, "")


def high_utilisation(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every lift that uses more than 90 % of the crane's capacity."""
    for component, crane, share in _used(subject):
        if share > HIGH_SHARE + 1e-9:
            said = f"uses {100.0 * share:.0f} % of the capacity of crane {crane.name!r}"
            yield about(component, HIGH_UTILISATION, Severity.MINOR, said)


def doubtful_mass(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every lift that the crane may not carry because its mass or its kind is an assumption."""
    for component, crane, share in _used(subject):
        unsure = component.mass_uncertainty
        heavier = _if_concrete(component)
        if share * heavier > 1.0 + 1e-9:
            said = f"is taken as {component.judgement.kind.value} ({component.judgement.why}); if it is concrete, it "
            said += f"weighs {tonnes(heavier * component.mass_kg)}, {100.0 * share * heavier:.0f} % of the capacity of "
            said += f"crane {crane.name!r}: say what it is ([model] kinds)"
            yield about(component, DOUBTFUL_MASS, Severity.SERIOUS, said)
            continue
        if share > DOUBTFUL_SHARE + 1e-9 and unsure >= ASSUMED:
            said = f"uses {100.0 * share:.0f} % of the capacity of crane {crane.name!r}, and its mass of "
            said += f"{tonnes(component.mass_kg)} is an assumption, which may be {100.0 * unsure:.0f} % too low: "
            yield about(component, DOUBTFUL_MASS, Severity.SERIOUS, said + "state its weight or material in the model")


def _if_concrete(component: Component) -> float:
    """Return how many times as much a part weighs if the assumption about its kind is wrong and it is concrete."""
    judgement = component.judgement
    if judgement.confidence is not Confidence.ASSUMED or component.mass_source != "default":
        return 1.0
    return (
        max(density_of_kind(Kind.CONCRETE) / density_of_kind(judgement.kind), 1.0) if judgement.kind in _LIGHT else 1.0
    )


def _used(subject: Subject) -> Iterator[tuple[Component, TowerCrane, float]]:
    """Yield every lifted part, its crane, and the largest share of that crane's capacity that its lift uses."""
    site = subject.site
    for number, crane in enumerate(site.cranes):
        own = [motion for motion in subject.motions if motion.crane == number]
        if not own:
            continue
        furthest = np.array([max(m.raising.radius_m.max(), m.loaded.radius_m.max()) for m in own])
        mass_kg = np.array([hung_kg(crane, site.components[motion.component]) for motion in own])
        used = shares_of_capacity(crane, furthest, 1.0) * mass_kg
        for motion, share in zip(own, used.tolist(), strict=True):
            yield site.components[motion.component], crane, share


def _since(subject: Subject) -> NDArray[np.int32]:
    """Return (X, Y, Z) the order of the lift that fills a cell; below 0 if a fixed object always does."""
    site = subject.site
    since = np.full(site.shape, _FREE, np.int32)
    for lift in reversed(subject.lifts):
        component = site.components[lift.component]
        _fill(since, component.shape.cells, np.array(component.target_vox, np.int32), lift.order)
    for number, blocker in enumerate(site.blockers):
        if blocker.kind != "crane":
            _fill(since, blocker.cells, np.zeros(3, np.int32), -1 - number)
    return since


def _feet(component: Component) -> NDArray[np.int32]:
    """Return (N, 3) the lowest cell of every column of a part."""
    cells = component.shape.cells[np.lexsort(component.shape.cells.T[::-1])]
    first = np.ones(len(cells), np.bool_)
    first[1:] = (np.diff(cells[:, :2], axis=0) != 0).any(axis=1)
    return np.ascontiguousarray(cells[first])


def _travelled(site: Site, component: Component, motion: LiftMotion) -> NDArray[np.float64]:
    """Return (N, 3) the reference cells of a load at the samples of its travel."""
    crane = site.crane_of(component)
    assert crane is not None
    load = load_frame(crane_for(site, crane, component), site.frame, component.hook_line_vox)
    time_ns = motion.loaded.time_ns + np.int64(motion.start_ns)
    inside = np.zeros(len(time_ns), np.bool_)
    for phase in motion.phases:
        if phase.name is PhaseName.TRAVERSE:
            inside |= (time_ns >= phase.start_ns) & (time_ns <= phase.end_ns)
    return cells_of_axes(load, motion.loaded.axes[inside])


@kernel
def _fill(since: NDArray[np.int32], cells: NDArray[np.int32], at: NDArray[np.int32], value: int) -> None:
    """Write a value to cells; those outside the grid are ignored."""
    nx, ny, nz = since.shape
    for n in range(cells.shape[0]):
        x, y, z = cells[n, 0] + at[0], cells[n, 1] + at[1], cells[n, 2] + at[2]
        if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz:
            since[x, y, z] = value


@kernel
def _least_gap(
    since: NDArray[np.int32], places: NDArray[np.float64], feet: NDArray[np.int32], own: int, reach: int
) -> tuple[float, int]:
    """Return the least height, in cells, of a load's feet over what is in place before a lift, and its number.

    The number is that in ``since``. A position between cells counts for the cells around it on plan. The height is
    ``reach`` if nothing is that near.
    """
    nx, ny, nz = since.shape
    least, below = float(reach), 0
    for n in range(places.shape[0]):
        for f in range(feet.shape[0]):
            foot = places[n, 2] + feet[f, 2]
            top = min(int(np.floor(foot + 1e-6)), nz)
            for corner in range(4):
                x = places[n, 0] + feet[f, 0]
                y = places[n, 1] + feet[f, 1]
                i = int(np.floor(x + 1e-6)) if corner // 2 == 0 else int(np.ceil(x - 1e-6))
                j = int(np.floor(y + 1e-6)) if corner % 2 == 0 else int(np.ceil(y - 1e-6))
                if i < 0 or j < 0 or i >= nx or j >= ny:
                    continue
                k = top - 1
                while k >= 0 and foot - (k + 1) < least - 1e-9:
                    if since[i, j, k] < own:
                        least, below = foot - (k + 1), since[i, j, k]
                        break
                    k -= 1
    return least, below
