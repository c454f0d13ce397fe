"""Precast buildings of boxes, by numbers: bays, storeys and slabs, with spans that a seed draws.

Columns stand one storey high, beams lie on their heads, slabs on the beams along x. Each joint has 20 mm.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bimvox.bim.building import Building, Casting, Element, Role, Source, Storey, TriangleMesh
from bimvox.bim.kinds.kind import Confidence, Judgement, Kind

_COLUMN_M, _BEAM_M, _SLAB_M, _JOINT_M, _STOREY_M = 0.4, (0.3, 0.5), 0.2, 0.02, 3.6
_SPANS_M = (4.5, 6.5)
_KG_M3, _HOLLOW_CORE_KG_M3 = 2_400.0, 1_400.0
_ROUND_M = 0.1
_FACES = np.array(
    [
        [0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
        [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5],
    ],
    np.int32,
)  # fmt: skip
"""Of a box whose corners vary fastest along x."""

Corner = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Precast:
    """A precast building of columns, beams and slabs.

    Attributes:
        bays: Bays along x and along y; no bay along y gives one row of columns.
        storeys: Storeys.
        slabs: Slabs a bay; 0 for an open frame.
        seed: Draws the spans, 4.5 to 6.5 m.
    """

    bays: tuple[int, int]
    storeys: int = 1
    slabs: int = 0
    seed: int = 0

    @property
    def lines_m(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Grid lines along x and along y, metres."""
        rng = np.random.default_rng([self.seed, *self.bays, self.storeys, self.slabs])
        spans = [_ROUND_M * np.round(rng.uniform(*_SPANS_M, count) / _ROUND_M) for count in self.bays]
        x, y = (tuple(np.round(np.concatenate([[0.0], np.cumsum(one)]), 3).tolist()) for one in spans)
        return x, y

    def building(self) -> Building:
        """Return it as a building that was read from a file would be."""
        elements = tuple(_element(*box) for box in self._boxes())
        said = repr((*self.bays, self.storeys, self.slabs, self.seed)).encode()
        storeys = tuple(Storey(_storey(n), n * _STOREY_M, n * _STOREY_M) for n in range(self.storeys))
        source = Source("precast", hashlib.sha256(said).hexdigest(), "generated", "m")
        return Building(elements, (), source, storeys=storeys)

    def _boxes(self) -> Iterator[tuple[str, str, str, Corner, Corner]]:
        """Return every part: class, name, storey, lowest and highest corner, metres."""
        for n in range(self.storeys):
            foot_m = n * _STOREY_M
            top_m = foot_m + _STOREY_M - (_SLAB_M if self.slabs else 0.0)
            for ifc_class, name, low, high in (*self._columns(foot_m, top_m), *self._beams(top_m), *self._slabs(top_m)):
                yield ifc_class, f"{name} {n}", _storey(n), low, high

    def _columns(self, foot_m: float, top_m: float) -> Iterator[tuple[str, str, Corner, Corner]]:
        half_m, head_m = _COLUMN_M / 2, top_m - _BEAM_M[1]
        for (i, x), (j, y) in itertools.product(*map(enumerate, self.lines_m)):
            yield "IfcColumn", f"Column {i}{j}", (x - half_m, y - half_m, foot_m), (x + half_m, y + half_m, head_m)

    def _beams(self, top_m: float) -> Iterator[tuple[str, str, Corner, Corner]]:
        """Return beams along x over the column heads, and along y between them, on the columns' outer thirds."""
        (width_m, height_m), (xs, ys), gap_m = _BEAM_M, self.lines_m, _JOINT_M / 2
        low_m, half_m = top_m - height_m, _BEAM_M[0] / 2
        for i, (j, y) in itertools.product(range(self.bays[0]), enumerate(ys)):
            ends = (xs[i] + gap_m, xs[i + 1] - gap_m)
            yield "IfcBeam", f"Beam x{i}{j}", (ends[0], y - half_m, low_m), (ends[1], y + half_m, top_m)
        for (i, x), j in itertools.product(enumerate(xs), range(self.bays[1])):
            ends = (ys[j] + half_m + _JOINT_M, ys[j + 1] - half_m - _JOINT_M)
            yield "IfcBeam", f"Beam y{i}{j}", (x - width_m / 2, ends[0], low_m), (x + width_m / 2, ends[1], top_m)

    def _slabs(self, top_m: float) -> Iterator[tuple[str, str, Corner, Corner]]:
        (xs, ys), gap_m = self.lines_m, _JOINT_M / 2
        for i, j, n in itertools.product(range(self.bays[0]), range(self.bays[1]), range(self.slabs)):
            width_m = (xs[i + 1] - xs[i]) / self.slabs
            x = xs[i] + n * width_m
            low, high = (x + gap_m, ys[j] + gap_m), (x + width_m - gap_m, ys[j + 1] - gap_m)
            yield "IfcSlab", f"Slab {i}{j}{n}", (*low, top_m), (*high, top_m + _SLAB_M)


def _storey(number: int) -> str:
    return f"Storey {number}"


def _element(ifc_class: str, name: str, storey: str, low: Sequence[float], high: Sequence[float]) -> Element:
    corners = np.array([[x, y, z] for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])])
    density = _HOLLOW_CORE_KG_M3 if ifc_class == "IfcSlab" else _KG_M3
    mass_kg = density * float(np.prod(np.subtract(high, low)))
    return Element(
        name,
        name,
        ifc_class,
        name,
        TriangleMesh(corners, _FACES),
        Role.COMPONENT,
        mass_kg,
        "density",
        storey=storey,
        material="precast concrete",
        casting=Casting.PRECAST,
        judgement=Judgement(Kind.PRECAST, Confidence.STATED, "the generator says so"),
    )
