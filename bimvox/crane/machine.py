"""A machine of the catalogue: everything that can stand on a site under one name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bimvox.crane.tower_crane import TowerCrane


@dataclass(frozen=True, slots=True)
class Machine:
    """A machine with all its jib lengths and reevings.

    Attributes:
        name: Its name.
        kind: ``hammerhead``, ``luffing`` or ``mobile``.
        about: One line about what it is and where its data come from.
        jibs_m: Length of the jib of each of ``cranes``; from the pivot for a luffing jib.
        cranes: The machine with each jib and reeving, on the origin: shorter jibs first, then fewer falls.
    """

    name: str
    kind: str
    about: str
    jibs_m: tuple[float, ...]
    cranes: tuple[TowerCrane, ...]

    @property
    def load_moment_tm(self) -> float:
        """Largest load moment, tonne-metres: the size of a machine."""
        return max(
            radius_m * mass_kg / 1000.0
            for crane in self.cranes
            for radius_m, mass_kg in zip(crane.chart.radius_m, crane.chart.capacity_kg, strict=True)
        )

    @property
    def lengths_m(self) -> tuple[float, ...]:
        """Its jib lengths, ascending."""
        return tuple(sorted(set(self.jibs_m)))

    @property
    def usual(self) -> TowerCrane:
        """The machine with its longest jib, and the reeving that carries most."""
        return carries_most(self.with_jib(max(self.jibs_m)))

    def with_jib(self, length_m: float) -> tuple[TowerCrane, ...]:
        """Return the machine with a jib length and each reeving; empty if it has no such jib."""
        return tuple(crane for crane, own in zip(self.cranes, self.jibs_m, strict=True) if abs(own - length_m) < 1e-3)


def carries_most(cranes: Sequence[TowerCrane]) -> TowerCrane:
    """Return the crane with the reeving that carries most."""
    return max(cranes, key=lambda crane: (crane.chart.capacity_kg[0], crane.falls))
