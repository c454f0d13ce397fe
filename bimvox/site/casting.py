"""The time of work that the crane does not do: cast in place, by class of work, built in place, or set by hand.

The defaults are typical values of the field, not measured:

* the work, in working hours of one person for a cubic metre of concrete: formwork, reinforcement and pouring together.
  A square metre of formwork takes 0.5 hours (slab, wall) to 1 hour (column, beam, stair), and a cubic metre has 4 to
  12 m2 of it; its 80 to 200 kg of reinforcement take 15 hours a tonne; pouring takes 0.5 to 1 hours. Professional
  judgement without a source at hand;
* the wait before it carries what stands on it, its props still under it: two days for what stands, seven days for what
  spans. By EN 1992-1-1, equation 3.2 (cement of class N, 20 degrees), concrete then has 50 % and 78 % of its strength.
  Seven days is also what ACI 347 recommends for slabs of 3 to 6 m ("Safe time to strip a slab", Concrete Construction);
* the wait before the joints of a lifted part carry: sixteen hours, from the end of a shift to the next one, for what
  stands on grout (columns, walls, footings) and for the grouted joints of floors. After that a grout of 50 N/mm2 mean
  strength with cement of class R has a third of it (EN 1992-1-1, equation 3.2, 20 degrees). A precast car park in Miami
  fell down in 2012 because columns were loaded before their bases were grouted (OSHA). Beams
  and stairs rest on dry bearings and steel is bolted: they carry at once. Floors, beams and stairs are set meanwhile:
  packers carry what is below them, and props hold it. So a storey waits for the joints of the one below. Professional
  judgement;
* a part that is set by hand: five minutes. Such parts of a storey and kind come up as one bundle; a bundle beyond
  300 kg is a load of the crane, in ten minutes: slinging, travel and release without bracing. Professional judgement.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from bimvox.bim.building import TriangleMesh
from bimvox.bim.kinds.kind import Judgement, Kind
from bimvox.site.default_rules import MOST_WORK_S, ON_GROUND_M
from bimvox.site.means import Means
from bimvox.site.work import Part, Work, kind_of, work_of
from bimvox.sparse import SPARSE

# The time of parts that a trade builds in their place, of pieces: masonry, partitions, glazing, earth.
#
# The defaults are working hours of one person, typical values of the field, not measured: a cubic metre of masonry of
# large blocks takes 3 to 4 hours, of bricks 6 to 8; a square metre of partition or cladding 0.8 to 1.2, of glazing 1 to
# 2; a cubic metre of filled earth half an hour. Masonry carries after a day. Professional judgement without a source at
# hand.


@dataclass(frozen=True, slots=True)
class BuildingTimes:
    """The times of parts that are built in place: ``BuildingConfig`` says what its fields mean."""

    people: float
    masonry_h_m3: float
    light_h_m2: float
    glazing_h_m2: float
    earth_h_m3: float
    other_h_m3: float
    wait_h: float


FIELD_BUILDING = BuildingTimes(4.0, 4.0, 1.0, 1.5, 0.5, 6.0, 24.0)
"""The defaults of the site file."""


def built_and_wait_s(building: BuildingTimes, kind: Kind, mesh: TriangleMesh) -> tuple[float, float]:
    """Return how long a part is built, and then waited for until it carries, seconds."""
    volume_m3 = abs(mesh.signed_volume_m3)
    if kind is Kind.LIGHT:
        hours = building.light_h_m2 * _side_m2(mesh)
    elif kind is Kind.GLAZING:
        hours = building.glazing_h_m2 * _side_m2(mesh)
    elif kind is Kind.MASONRY:
        hours = building.masonry_h_m3 * volume_m3
    elif kind is Kind.EARTH:
        hours = building.earth_h_m3 * volume_m3
    else:
        hours = building.other_h_m3 * volume_m3
    return min(3600.0 * hours / building.people, MOST_WORK_S), 3600.0 * building.wait_h


def _side_m2(mesh: TriangleMesh) -> float:
    """Return half the surface of a mesh: of a thin part, one of its sides."""
    a, b, c = np.moveaxis(mesh.triangles_m, 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 4.0


CONCRETE_KG_M3 = 2400.0
"""Mass of a cubic metre, by which the volume of work follows from its mass: files state it more often than volumes."""


@dataclass(frozen=True, slots=True)
class CastTimes:
    """The time of a class of work that is cast in place: ``CastTimesConfig`` says what its fields mean."""

    hours_m3: float
    wait_h: float


@dataclass(frozen=True, slots=True)
class Casting:
    """The times of work that the crane does not do: ``CastingConfig`` says what its fields mean."""

    people: float
    hand_s: float
    bundle_kg: float
    bundle_s: float
    footing: CastTimes
    column: CastTimes
    wall: CastTimes
    beam: CastTimes
    slab: CastTimes
    stair: CastTimes
    steel: CastTimes
    other: CastTimes


@dataclass(frozen=True, slots=True)
class Curing:
    """Hours from the release of a lifted part until its joints carry what rests on it, by class of work.

    Attributes:
        floors_wait: Whether not only columns and walls wait for them.
    """

    footing_h: float = 0.0
    column_h: float = 0.0
    wall_h: float = 0.0
    beam_h: float = 0.0
    slab_h: float = 0.0
    stair_h: float = 0.0
    steel_h: float = 0.0
    other_h: float = 0.0
    floors_wait: bool = field(default=True, metadata=SPARSE)


FIELD_CURING = Curing(footing_h=16.0, column_h=16.0, wall_h=16.0, slab_h=16.0, other_h=16.0, floors_wait=False)
"""The defaults of a site file with a crane."""


FIELD_CASTING = Casting(
    people=8.0,
    hand_s=300.0,
    bundle_kg=300.0,
    bundle_s=600.0,
    footing=CastTimes(3.0, 48.0),
    column=CastTimes(14.0, 48.0),
    wall=CastTimes(6.0, 48.0),
    beam=CastTimes(11.0, 168.0),
    slab=CastTimes(4.5, 168.0),
    stair=CastTimes(15.0, 168.0),
    steel=CastTimes(40.0, 0.0),
    other=CastTimes(6.0, 48.0),
)
"""The defaults of the site file."""


class _JudgedPart(Part, Protocol):
    """A part of which is known what it is and how it gets to its place."""

    @property
    def judgement(self) -> Judgement:
        """What kind of part it is."""

    @property
    def means(self) -> Means:
        """How it gets to its place."""

    @property
    def spans(self) -> bool:
        """Whether it is as low as the ground and yet over other parts."""


def work_and_wait_s(
    casting: Casting, building: BuildingTimes, part: _JudgedPart, mass_kg: float
) -> tuple[float, float]:
    """Return how long a part that the crane does not set is worked on, and then waited for until it carries, seconds.

    Both are 0 for a part that the crane should set but cannot: nobody has said how it gets there.
    """
    if part.means is Means.BY_HAND:
        return casting.hand_s, 0.0
    if part.means is Means.CRANE:
        return 0.0, 0.0
    if part.means is Means.BUILT:
        return built_and_wait_s(building, part.judgement.kind, part.mesh)
    own = times_of(casting, _cast_work(part))
    work_s = 3600.0 * own.hours_m3 * mass_kg / CONCRETE_KG_M3 / casting.people
    return min(work_s, MOST_WORK_S), 3600.0 * own.wait_h


def curing_s(curing: Curing | None, part: Part) -> float:
    """Return how long the joints of a lifted part cure until they carry what rests on it, seconds; 0 without a rule."""
    hours: float = 0.0 if curing is None else getattr(curing, f"{work_of(part).value}_h")
    return 3600.0 * hours


def waits_for_joints(curing: Curing | None, part: Part) -> bool:
    """Return whether a part waits until the joints of the lifted parts that it rests on carry."""
    return curing is not None and (curing.floors_wait or kind_of(part) in _UPRIGHTS)


_UPRIGHTS = frozenset((Work.COLUMN, Work.WALL))


def _cast_work(part: _JudgedPart) -> Work:
    """Return the class of work of a part that is cast: what lies on the ground spans nothing, so it is a footing."""
    work = work_of(part)
    spans = work in (Work.BEAM, Work.SLAB, Work.STAIR)
    return Work.FOOTING if spans and not part.spans and part.mesh.bounds_m[0, 2] <= ON_GROUND_M else work


def times_of(casting: Casting, work: Work) -> CastTimes:
    """Return the times of a class of work."""
    result: CastTimes = getattr(casting, work.value)
    return result
