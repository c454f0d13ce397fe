"""The measurements, as plain values."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median

from benchmarks.voxelize.score import Score
from benchmarks.voxelize.tool import ToolInfo


@dataclass(frozen=True, slots=True)
class Row:
    """One tool on one case.

    Attributes:
        tool: Name of the tool.
        version: Version of its package; empty if it is not installed.
        failure: Why there are no figures; empty if there are.
        cpu_s: Processor time of the runs that count, the same as wall time on an idle core.
        wall_s: Wall time of the same runs, including other load on the machine.
        memory_mb: Growth of the resident set at its peak, MB.
        solid_cells: Cells that are not air, if the tool counts them.
        score: Score against the oracle, if requested.
        timeout_s: Time after which it was stopped; the failure says so.
    """

    tool: ToolInfo
    version: str
    failure: str = ""
    cpu_s: tuple[float, ...] = ()
    wall_s: tuple[float, ...] = ()
    memory_mb: float = 0.0
    solid_cells: int | None = None
    score: Score | None = None
    timeout_s: float | None = None

    @property
    def median_s(self) -> float | None:
        """Median processor time; None if there is none."""
        return median(self.cpu_s) if self.cpu_s else None


@dataclass(frozen=True, slots=True)
class CaseResult:
    """All tools on one case.

    Attributes:
        name: Name of the case.
        voxel_size_m: Edge of a cell.
        dense: Whether it is one body that is nearly all interior.
        parts: Number of parts.
        triangles: Number of triangles.
        cells: Cells of the grid.
        windows: Windows in which answers are judged; 0 if none were.
        judged_pairs: Parts judged in them (a part counts once a window).
        judged_cells: Cells judged: those of a window count once for each of its parts.
        undecided_cells: Of these, too close to the tolerance to say, or of parts that are not closed solids.
        rows: Ours first.
    """

    name: str
    voxel_size_m: float
    dense: bool
    parts: int
    triangles: int
    cells: int
    windows: int
    judged_pairs: int
    judged_cells: int
    undecided_cells: int
    rows: tuple[Row, ...]

    def row(self, key: str) -> Row | None:
        """Return a tool's row, if it was run."""
        return next((row for row in self.rows if row.tool.key == key), None)

    def ratio(self, key: str) -> float | None:
        """Return a tool's time divided by ours; None if either is missing."""
        ours, other = self.row("bimvox"), self.row(key)
        if ours is None or other is None or ours.median_s is None or other.median_s is None:
            return None
        return other.median_s / ours.median_s
