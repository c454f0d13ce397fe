"""The base of every part of the proof of a lift."""

from __future__ import annotations

from collections.abc import Mapping

from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.bodies.triangles import TriangleCheck
from bimvox.proof.space import ALWAYS_NS, RawCells
from bimvox.records.proof import Check
from bimvox.site.site import Site


class LiftProof:
    """Checks the lifts of one crane in order.

    Args:
        site: The site as this crane sees it.
        crane: The crane.
        triangles: The triangle test.
        cells: What is where at the current lift; updated by the caller or by parts of the proof.
        checks: Receive the results, by name.
        window_ns: Collisions count only in this span of the site's clock.
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
