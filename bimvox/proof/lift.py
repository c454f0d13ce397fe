"""The base of every part of the proof of a lift."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.bodies.triangles import TriangleCheck
from bimvox.proof.heading import cells_at_any_heading
from bimvox.proof.placements import Placements
from bimvox.proof.space import ALWAYS_NS, BETWEEN_VOX, RawCells
from bimvox.records.proof import Check
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
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

    def check_zones(
        self,
        name: str,
        placements: Placements,
        component: Component | None,
        cells: NDArray[np.float64],
        time_s: NDArray[np.float64],
        turning: NDArray[np.bool_] | None = None,
    ) -> None:
        """Check that no zone forbids hook or load, and that the hook respects the height limiters.

        ``placements`` are the whole placements around the positions ``cells`` ((N, 3) reference cells) at ``time_s``
        ((N,)). For the empty hook, ``component`` is None. ``turning`` ((N,)): where the load may have any heading.
        """
        site = self.site
        offset = np.array((0, 0, 0) if component is None else component.hook_offset_vox)

        def over(zone: NDArray[np.bool_], offsets: NDArray[np.int64]) -> NDArray[np.bool_]:
            """Return which placements have one of these columns, relative to the reference cell, over a zone."""
            found = np.zeros(len(placements.cells), np.bool_)
            for column in offsets:
                at = placements.cells[:, :2] + column
                inside = ((at >= 0) & (at < zone.shape)).all(axis=1)
                found[inside] |= zone[at[inside, 0], at[inside, 1]]
            return found

        def look(bad: NDArray[np.bool_], what: str) -> None:
            self.checks["zones"].look(
                not bad.any(), f"{name}: {what} at {time_s[int(np.argmax(bad))]:.2f} s", samples=len(bad)
            )

        if site.prohibited is not None:
            look(
                placements.at_positions(over(site.prohibited, offset[None, :2])),
                "the hook is over a prohibited zone",
            )
        if site.no_load is not None and component is not None:
            columns = np.unique(component.shape.cells[:, :2], axis=0).astype(np.int64)
            met = placements.at_positions(over(site.no_load, columns))
            if turning is not None and turning.any():
                wide = np.unique(cells_at_any_heading(component)[:, :2], axis=0).astype(np.int64)
                met |= placements.at_positions(over(site.no_load, wide)) & turning
            look(met, "the load is over a zone that is closed to it")
        if site.hook_heights is not None:
            sling_m = crane_for(site, self.crane, component).sling_m
            hook_m = site.frame.origin_m[2] + (cells[:, 2] + offset[2]) * site.frame.voxel_size_m + sling_m
            columns = placements.cells[:, :2] + offset[:2]
            shape = site.hook_heights.low_m.shape
            inside = ((columns >= 0) & (columns < shape)).all(axis=1)
            low, high = np.full(len(columns), -np.inf), np.full(len(columns), np.inf)
            low[inside] = site.hook_heights.low_m[columns[inside, 0], columns[inside, 1]]
            high[inside] = site.hook_heights.high_m[columns[inside, 0], columns[inside, 1]]
            slack_m = BETWEEN_VOX * site.frame.voxel_size_m
            wrong = hook_m < low[placements.around].max(axis=0) - slack_m
            look(
                wrong | (hook_m > high[placements.around].min(axis=0) + slack_m),
                "the hook is not as high as a limiter wants it",
            )
