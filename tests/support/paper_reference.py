"""A slow, independent implementation of the construction site: sets of cells, without kernels or tables."""

from __future__ import annotations

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from bimvox.paper.env.layout import PaperLayout, every_component_has_a_way, write_layout
from bimvox.paper.env.spec import PaperSpec, RandomObstructions, beam, column
from bimvox.paper.env.state import drawing_of, empty_site, rules_of

STEP = {0: (0, 1, 0), 1: (0, -1, 0), 2: (-1, 0, 0), 3: (1, 0, 0), 4: (0, 0, 1), 5: (0, 0, -1)}


def cells_of(box):
    (x0, y0, z0), (x1, y1, z1) = box
    return {(x, y, z) for x in range(x0, x1) for y in range(y0, y1) for z in range(z0, z1)}


class ReferenceSite:
    """One episode of a layout by the paper's rules and equation (1)."""

    def __init__(self, spec: PaperSpec, layout: PaperLayout) -> None:
        self.spec, self.layout = spec, layout
        self.slab = {(x, y, 0) for x in range(spec.shape[0]) for y in range(spec.shape[1])}
        self.obstructions = [cells_of(box) for box in layout.obstructions]
        self.current = 0
        self.total = 0
        self._hang()

    def _hang(self) -> None:
        self.steps = 0
        if self.current < self.spec.count:
            place = self.layout.starts[self.current]
            self.at = (place.x, place.y, 2)

    def stored(self, i):
        return cells_of(self.layout.starts[i].box(self.spec.components[i].length_vox))

    def placed(self, i, cell):
        return cells_of(self.spec.components[i].box_at(cell))

    def others(self):
        """Return all objects except the one in transit as sets of cells."""
        built = [self.placed(i, self.layout.targets[i]) for i in range(self.current)]
        waiting = [self.stored(i) for i in range(self.current + 1, self.spec.count)]
        return [self.slab, *self.obstructions, *built, *waiting]

    def step(self, action):
        """Take an action; return reward, bumped, terminated, truncated."""
        n, serial = self.spec.count, self.current + 1
        reward = (-2.0 if self.steps >= self.spec.steps_before_late else -1.0) / serial
        there = tuple(a + d for a, d in zip(self.at, STEP[int(action)], strict=True))
        body = self.placed(self.current, there)
        inside = all(0 <= c[a] < self.spec.shape[a] for c in body for a in range(3))
        free = inside and not any(body & other for other in self.others())
        if free:
            self.at = there
        self.steps += 1
        self.total += 1
        if self.at == self.layout.targets[self.current]:
            reward = n * serial
            self.current += 1
            self._hang()
        terminated = self.current == n
        return reward, not free, terminated, not terminated and self.total >= self.spec.steps_allowed

    def map(self):
        out = np.zeros((*self.spec.shape[:2], 6), np.float32)

        def highest(channel, cells, value=None):
            for x, y, z in cells:
                out[x, y, channel] = max(out[x, y, channel], z if value is None else value)

        for cells in self.obstructions:
            highest(0, cells)
        for i in range(self.spec.count):
            if i > self.current:
                highest(0, self.stored(i))
            else:
                highest(3, self.placed(i, self.layout.targets[i]))
            if i < self.current:
                highest(4, self.placed(i, self.layout.targets[i]), 1)
                highest(5, self.placed(i, self.layout.targets[i]), self.current)
        if self.current < self.spec.count:
            body = self.placed(self.current, self.at)
            highest(2, body)
            if self.steps >= self.spec.steps_before_late:
                highest(1, body, 1)
        return out


@st.composite
def specs(draw):
    """Draw small sites with up to four components, obstructions and drawn targets."""
    nx, ny, nz = draw(st.integers(6, 9)), draw(st.integers(6, 9)), draw(st.integers(5, 7))
    x0, y0 = draw(st.integers(0, 3)), draw(st.integers(0, 3))
    area = (x0, y0, x0 + draw(st.integers(2, 3)), y0 + draw(st.integers(2, 3)))
    parts = []
    for _ in range(draw(st.integers(1, 4))):
        cell = (draw(st.integers(area[0], area[2] - 1)), draw(st.integers(area[1], area[3] - 1)))
        if draw(st.booleans()):
            parts.append(column(draw(st.integers(1, 3)), (*cell, 1)))
        else:
            parts.append(beam(draw(st.integers(1, 3)), (*cell, draw(st.integers(1, 4))), draw(st.sampled_from("xy"))))
    try:
        return PaperSpec(
            (nx, ny, nz),
            area,
            tuple(parts),
            random_obstructions=draw(st.sampled_from([None, RandomObstructions(0, 2, 2, 2)])),
            random_targets=draw(st.booleans()),
            step_limit=draw(st.integers(1, 6)),
            max_steps=draw(st.integers(1, 40)),
        )
    except ValueError:
        assume(False)


def is_solvable(spec: PaperSpec, layout: PaperLayout) -> bool:
    """Return whether every component of a layout can reach its target, one after the other, however many steps."""
    spec = spec.in_building_order()
    site = empty_site(spec, drawing_of(spec, room_for=len(layout.obstructions)), with_field=False)
    write_layout(spec, layout, site)
    return bool(every_component_has_a_way(rules_of(spec), site))
