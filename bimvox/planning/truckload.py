"""What one truck carries: its mass, and room for its parts on a flat bed or in an inloader.

The rule of room: parts are loaded in the order of their lifts, so the one that is needed first is unloaded last and
lies on top in the yard. Each lies with its longest edge along the bed and its shortest upwards; a wall stands, and a
brace or a rafter, which is set at a slope, is laid flat. They lie one behind the other in a row, rows next to each
other in a layer, layers on each other with dunnage between. It leaves gaps that a good driver fills, and says nothing
about axle loads or how the load is secured.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from bimvox.kept import kept
from bimvox.site.component import Component
from bimvox.site.site import Site
from bimvox.site.upright_box import boxes_m
from bimvox.site.work import Work, kind_of
from bimvox.site.yard_rules import INLOADER_M

Size = tuple[float, float, float]
"""Along, across and above the bed, m."""
_ROUNDING_M = 1e-6
_KG = 1e-6


class Truckload:
    """The parts on one truck so far.

    A heavier part comes alone. A larger one comes with the delivery by a special transport, and takes no room on its
    truck.

    Args:
        site: The site.
    """

    def __init__(self, site: Site) -> None:
        self._most_kg = site.rules.truckload_kg
        yard = site.rules.yard
        beds = () if yard is None or yard.truck_m is None or not self._most_kg else (yard.truck_m, INLOADER_M)
        self._empty = [_Bed(size, yard.dunnage_m) for size in beds if yard is not None]
        self._beds = self._empty
        self._mass_kg, self._parts = 0.0, 0

    def __len__(self) -> int:
        return self._parts

    def is_full_for(self, component: Component) -> bool:
        """Return whether a part must come with the next truck."""
        if not self._parts or not self._most_kg:
            return False
        if self._mass_kg + component.mass_kg > self._most_kg + _KG:
            return True
        return self._takes_room(component) and not any(bed.with_part(_ways_m(component)) for bed in self._beds)

    def add(self, component: Component) -> None:
        """Load a part."""
        if self._takes_room(component):
            loaded = (bed.with_part(_ways_m(component)) for bed in self._beds)
            self._beds = [bed for bed in loaded if bed is not None]
        self._mass_kg += component.mass_kg
        self._parts += 1

    def _takes_room(self, component: Component) -> bool:
        return any(bed.with_part(_ways_m(component)) for bed in self._empty)


def fit_trucks(site: Site, order: Iterable[int], deliveries: Mapping[int, int]) -> bool:
    """Return whether every delivery fits onto its truck, loaded in an order of all parts.

    Args:
        site: The site.
        order: The parts in the order of their lifts.
        deliveries: The delivery of each part that has a place in the yard.
    """
    loads: dict[int, Truckload] = {}
    for part in order:
        if part in deliveries:
            load = loads.setdefault(deliveries[part], Truckload(site))
            if load.is_full_for(site.components[part]):
                return False
            load.add(site.components[part])
    return True


@dataclass(frozen=True, slots=True)
class _Bed:
    size_m: Size
    dunnage_m: float
    top_m: float = 0.0  # of the layers below
    rows_m: float = 0.0  # width of the finished rows of this layer
    high_m: float = 0.0  # of this layer
    row_m: tuple[float, float] = (0.0, 0.0)  # length and width of this row

    def with_part(self, ways_m: tuple[Size, ...]) -> _Bed | None:
        """Return the bed with one more part, which lies in the first way that an empty bed takes; None if full."""
        empty = _Bed(self.size_m, self.dunnage_m)
        way = next((way for way in ways_m if empty.holds(way)), None)
        if way is None:
            return None
        along, across, high = way
        (length, width), tallest = self.row_m, max(self.high_m, high)
        same_row = self._with(self.top_m, self.rows_m, tallest, (length + along, max(width, across)))
        next_row = self._with(self.top_m, self.rows_m + width, tallest, (along, across))
        top_m = self.top_m + self.high_m + self.dunnage_m
        next_layer = self._with(top_m, 0.0, high, (along, across))
        return next((bed for bed in (same_row, next_row, next_layer) if bed.holds()), None)

    def holds(self, more_m: Size | None = None) -> bool:
        """Return whether what is loaded, or one part on an empty bed, is within its limits."""
        used = more_m or (self.row_m[0], self.rows_m + self.row_m[1], self.top_m + self.high_m)
        return all(own <= most + _ROUNDING_M for own, most in zip(used, self.size_m, strict=True))

    def _with(self, top_m: float, rows_m: float, high_m: float, row_m: tuple[float, float]) -> _Bed:
        return _Bed(self.size_m, self.dunnage_m, top_m, rows_m, high_m, row_m)


@kept
def _ways_m(component: Component) -> tuple[Size, ...]:
    """Return how a part may lie on a truck, the usual way first."""
    stands = kind_of(component) is Work.WALL
    boxes = boxes_m(component.mesh)
    pairs = (((long_m, wide_m, thin_m), (long_m, thin_m, wide_m)) for long_m, wide_m, thin_m in boxes)
    return tuple(way for flat, on_edge in pairs for way in ((on_edge, flat) if stands else (flat, on_edge)))
