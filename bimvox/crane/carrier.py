"""How a crane stands: outriggers, counterweight, masses, sectors of a mobile one; base and loads of a tower crane."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import pi

from bimvox.crane.load_chart import LoadChart
from bimvox.errors import InputError
from bimvox.sparse import SPARSE


@dataclass(frozen=True, slots=True)
class SectorChart:
    """The load chart within a sector of slewing angles.

    Attributes:
        name: As the maker calls it: ``over rear``.
        from_rad: First angle from the direction of the carrier's front, counter-clockwise.
        to_rad: Last angle, above the first, at most a turn further.
        chart: What the crane carries there; None if it has no chart there, so that no load may hang there.

    Raises:
        InputError: If the angles are not a sector.
    """

    name: str
    from_rad: float
    to_rad: float
    chart: LoadChart | None = None

    def __post_init__(self) -> None:
        """Raise an error for an invalid sector."""
        if not (-2.0 * pi <= self.from_rad < self.to_rad <= self.from_rad + 2.0 * pi + 1e-9):
            raise InputError(
                f"sector {self.name!r} from {self.from_rad:g} to {self.to_rad:g} rad",
                hint="give the first angle and the last one, counter-clockwise, at most one turn apart",
            )


@dataclass(frozen=True, slots=True)
class Outriggers:
    """A base of outriggers: how far its pads are from the slewing axis, metres.

    Attributes:
        name: As the maker calls it: ``full``, ``half``.
        front_m: Of the front pads, towards the carrier's front.
        rear_m: Of the rear pads, towards its rear.
        left_m: Of the left pads.
        right_m: Of the right pads.
    """

    name: str
    front_m: float
    rear_m: float
    left_m: float
    right_m: float

    @property
    def area_m2(self) -> float:
        """Area between the pads."""
        return (self.front_m + self.rear_m) * (self.left_m + self.right_m)


@dataclass(frozen=True, slots=True)
class Masses:
    """Masses of a mobile crane without counterweight and load, and where their centres are.

    Attributes:
        carrier_kg: Undercarriage with outriggers.
        carrier_ahead_m: Its centre ahead of the slewing axis, towards the carrier's front; negative behind.
        superstructure_kg: What slews, without boom and counterweight.
        superstructure_ahead_m: Its centre ahead of the slewing axis, towards the hook; negative behind.
        boom_kg: The boom.
        boom_share: Its centre, as a share of its length from the pivot.
        counterweight_behind_m: Centre of the counterweight behind the slewing axis.
    """

    carrier_kg: float
    carrier_ahead_m: float
    superstructure_kg: float
    superstructure_ahead_m: float
    boom_kg: float
    boom_share: float
    counterweight_behind_m: float


@dataclass(frozen=True, slots=True)
class BaseLoads:
    """Loads on the foundation of a tower crane, as its maker states them; None for what is not stated.

    Attributes:
        vertical_kn: Vertical load.
        horizontal_kn: Horizontal load.
        moment_knm: Overturning moment.
        slewing_knm: Moment of slewing.
        corner_kn: Largest load of a corner.
    """

    vertical_kn: float | None = None
    horizontal_kn: float | None = None
    moment_knm: float | None = None
    slewing_knm: float | None = None
    corner_kn: float | None = None


@dataclass(frozen=True, slots=True)
class Stand:
    """How a tower crane stands with a jib, as its maker states it; None for what is not stated.

    Attributes:
        base: What it stands on, in words: ``cross base 6 x 6 m``.
        edge_m: Edge of the square that this covers.
        ballast_kg: Ballast on the base.
        free_standing_m: Highest hook above the foot without ties.
        in_service: Loads on the foundation in service.
        out_of_service: Loads on the foundation out of service.
        mass_kg: Mass of the crane without the ballast on its base.
        tail_radius_m: How far its counter-jib reaches back from the slewing axis.
    """

    base: str = ""
    edge_m: float | None = None
    ballast_kg: float | None = None
    free_standing_m: float | None = None
    in_service: BaseLoads | None = None
    out_of_service: BaseLoads | None = None
    mass_kg: float | None = field(default=None, metadata=SPARSE)
    tail_radius_m: float | None = field(default=None, metadata=SPARSE)


@dataclass(frozen=True, slots=True)
class Carrier:
    """How a mobile crane is set up.

    Attributes:
        heading_rad: Direction of the carrier's front from the site's x axis, counter-clockwise.
        counterweight_kg: Counterweight that is fitted; None if the machine file has no choice.
        outriggers: Base that is in use; None if the machine file has none.
        sectors: Charts of sectors, by ascending first angle; elsewhere the crane's own chart holds.
        rating: Which share of what the charts are, and by which standard, in words; empty if nobody says so.
        deductions: What the charts are reduced by: name and mass.
        masses: Its masses; None if nobody states them.

    Raises:
        InputError: If two sectors overlap.
    """

    heading_rad: float = 0.0
    counterweight_kg: float | None = None
    outriggers: Outriggers | None = None
    sectors: tuple[SectorChart, ...] = ()
    rating: str = ""
    deductions: tuple[tuple[str, float], ...] = ()
    masses: Masses | None = field(default=None, metadata=SPARSE)

    def __post_init__(self) -> None:
        """Raise an error for sectors that overlap."""
        first = self.sectors[:1]
        for one, other in pairwise((*self.sectors, *first)):
            turn_rad = 2.0 * pi if other is first[0] else 0.0
            if len(self.sectors) > 1 and other.from_rad + turn_rad < one.to_rad - 1e-9:
                raise InputError(
                    f"sectors {one.name!r} and {other.name!r} overlap",
                    hint="give every angle to one sector, by ascending first angle",
                )
