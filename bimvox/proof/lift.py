"""What every part of the proof of a lift rests on."""

from __future__ import annotations

from collections.abc import Mapping

from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.space import ALWAYS_NS, RawCells
from bimvox.proof.triangles import TriangleCheck
from bimvox.records.proof import Check
from bimvox.site.site import Site


class LiftProof:
    """Looks at the lifts of one crane, one after the other.

    Args:
        site: The site as the crane works on it.
        crane: The crane.
        triangles: The test of real triangles.
        cells: What stands where now; moved on by the caller, or to what a part of the proof needs.
        checks: Where results go, by name.
        window_ns: What is there is met in this span of the site's clock only.
    """

    def __init__(
        self,
        site: Site,
        crane: TowerCrane,
        triangles: TriangleCheck,
        cells: RawCells,
        checks: Mapping[str, Check],
        window_ns: tuple[int, int] = ALWAYS_NS,
    ) -> None:
        self.window_ns, self.start_ns = window_ns, 0
        self.site, self.crane, self.triangles, self.cells, self.checks = site, crane, triangles, cells, checks
