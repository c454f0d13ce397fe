"""How a part is turned over in the air between the main and the auxiliary hook of one crane."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Flip:
    """The turn of a part from lying to upright, on two ropes that hang straight down.

    Attributes:
        main_m: Where the main hook holds it: at the middle of its head, above its centre of mass; (x, y, z) with the
            part at its place in the building, metres in the site frame.
        auxiliary_m: Where the auxiliary hook holds it: on the side that is up as it lies, a quarter of its height from
            its foot.
        angle_deg: Angles of the turn, ascending: 0 lying, 90 upright.
        main_kg: Share of its mass on the main hook at each.
        auxiliary_kg: Share of its mass on the auxiliary hook at each.
        main_used: Largest share of the capacity of the main hook: mass, rigging and hook block.
        auxiliary_used: The same of the auxiliary hook.
        both_used: The same of the load chart by both together, at the larger of their radii.
        radius_m: Radius of the main hook.
        clear_m: Least distance of the part above the ground that it lay on, while it turns.
        lean_rad: Largest angle of a rope to the vertical: the ropes hang a fixed distance apart, the lifting points
            do not.
    """

    main_m: tuple[float, float, float]
    auxiliary_m: tuple[float, float, float]
    angle_deg: tuple[float, ...]
    main_kg: tuple[float, ...]
    auxiliary_kg: tuple[float, ...]
    main_used: float
    auxiliary_used: float
    both_used: float
    radius_m: float
    clear_m: float
    lean_rad: float

    @property
    def used(self) -> float:
        """The largest share of a capacity."""
        return max(self.main_used, self.auxiliary_used, self.both_used)
