"""What holds a part from its release until its joints carry: the props of the catalogue, and the rules for them.

* Two push-pull props or more hold a wall or a column, at two thirds of its height ("Rules of thumb for the use of
  push-pull props", Titan), at right angles to it, inclined by 40 to 60 degrees (WorkSafe Victoria, "Skewed panel braces
  can be dangerous").
* They bear a wind of 0.5 kN/m2 on it, as the table of one maker does (hiprop2000.co.nz), and 2 % of its weight, for a
  part that is out of plumb (professional judgement).
* The catalogue is generic: lengths as makers list them, loads not larger than that maker's for the same length (50, 36,
  22 and 15 kN at 4.0, 5.6, 7.3 and 8.9 m).
* On the ground a prop stands on a block that neither slides nor lifts off.
* Shores are telescopic floor props of class D of EN 1065: 20 kN, however far they are extended. Below planks that get a
  topping they stand in lines at most 1.5 m apart, and bear plank, topping and 1.5 kN/m2 of people and concrete that is
  heaped up (EN 12812; professional judgement).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class PropKind(StrEnum):
    """What a prop is."""

    PUSH_PULL = "push_pull"
    """Inclined, fixed at both ends: it holds what stands."""
    SHORE = "shore"
    """Upright below what spans."""


@dataclass(frozen=True, slots=True)
class PropType:
    """A type of props.

    Attributes:
        name: Its name.
        kind: What it is.
        least_m: Its shortest length.
        most_m: Its longest length.
        load_kn: What it carries at its longest length.
    """

    name: str
    kind: PropKind
    least_m: float
    most_m: float
    load_kn: float


PROP_TYPES = (
    PropType("push-pull prop 1.2-2.1 m", PropKind.PUSH_PULL, 1.2, 2.1, 20.0),
    PropType("push-pull prop 1.9-3.4 m", PropKind.PUSH_PULL, 1.9, 3.4, 20.0),
    PropType("push-pull prop 3.1-5.6 m", PropKind.PUSH_PULL, 3.1, 5.6, 20.0),
    PropType("push-pull prop 5.2-7.3 m", PropKind.PUSH_PULL, 5.2, 7.3, 20.0),
    PropType("push-pull prop 6.8-8.9 m", PropKind.PUSH_PULL, 6.8, 8.9, 15.0),
    PropType("shore EN 1065 D25", PropKind.SHORE, 1.47, 2.5, 20.0),
    PropType("shore EN 1065 D30", PropKind.SHORE, 1.72, 3.0, 20.0),
    PropType("shore EN 1065 D40", PropKind.SHORE, 2.24, 4.0, 20.0),
    PropType("shore EN 1065 D55", PropKind.SHORE, 3.03, 5.5, 20.0),
)
"""The catalogue, of each kind the shortest first."""


@dataclass(frozen=True, slots=True)
class PropRules:
    """The rules for props; ``PropsConfig``, a table of the site file, says what its fields mean."""

    wind_kn_m2: float
    clearance_m: float
    shore_spacing_m: float
    plank_m: float
    types: tuple[PropType, ...] = PROP_TYPES


FIELD_PROPS = PropRules(wind_kn_m2=0.5, clearance_m=0.3, shore_spacing_m=1.5, plank_m=0.12)
"""The defaults of a site file with a crane."""
FRICTION, SAFETY = 0.4, 1.5
"""Of a block on the ground, against sliding and lifting off (professional judgement; EN 12812 gives 0.4 to 0.8 for
concrete on ground)."""
LEAN = 0.02
"""Horizontal load of a part that is out of plumb, as a share of its weight."""
WORKING_KN_M2 = 1.5
"""People, and concrete that is heaped up, on a plank with fresh topping."""
