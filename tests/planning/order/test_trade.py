"""The order of the trade: floor by floor, and within a floor by class, as far as geometry permits."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from box_sites import box_site
from numpy.typing import NDArray

from bimvox.bim.read import read_building
from bimvox.library.site import LoadedSite, guess_site, load_site
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.order.faster_order import order_and_yard
from bimvox.planning.order.relations import order_graph, precedence
from bimvox.planning.order.sequence import ErectionSequence, Sequencer, stages
from bimvox.site.component import OrderHints
from bimvox.site.site import Site

PREFAB = Path(__file__).parents[3] / "sample_models" / "prefab.ifc"
RANKS = {"IfcColumn": 1, "IfcWall": 1, "IfcBeam": 2, "IfcSlab": 3}
NEAR_M, STEP_M = 0.6, 0.5


def sequence_of(site: Site) -> ErectionSequence:
    contacts = Contacts(site)
    return order_and_yard(site, Sequencer(site, precedence(site, contacts), contacts))[0]


def part(name: str, low, high, ifc_class: str, **more) -> tuple:
    return (name, low, high, {"ifc_class": ifc_class, "hints": OrderHints(rank=RANKS[ifc_class], **more)})


def names(parts: list[tuple]) -> tuple[list[str], tuple[str, ...]]:
    site = box_site(parts, shape=(40, 30, 40))
    sequence = sequence_of(site)
    return [site.components[i].id for i in sequence.order], sequence.notes


BAYS = [
    part("floor 1", (0, 0, 3.0), (6, 2, 3.2), "IfcSlab", storey_rank=1),
    part("floor 2", (0, 4, 3.0), (6, 6, 3.2), "IfcSlab", storey_rank=0),
    part("beam", (8, 4, 2.6), (12, 4.4, 3.2), "IfcBeam", storey_rank=0),
    *(part(f"post {n}", (x, y, 0), (x + 0.4, y + 0.4, 2.98), "IfcColumn", storey_rank=0)
      for n, (x, y) in enumerate([(0, 0.8), (5.6, 0.8), (0, 4.8), (5.6, 4.8)])),
    *(part(f"leg {n}", (x, 4, 0), (x + 0.4, 4.4, 2.58), "IfcColumn", storey_rank=0) for n, x in enumerate([8, 11.6])),
    part("wall on floor 1", (0, 0, 3.22), (6, 0.2, 6.0), "IfcWall", storey_rank=1),
    part("wall on floor 2", (0, 5.8, 3.22), (6, 6, 6.0), "IfcWall", storey_rank=1),
]  # fmt: skip


def test_columns_then_beams_then_slabs_then_what_stands_on_the_floor() -> None:
    order, notes = names(BAYS)
    kinds = [name.split()[0] for name in order]
    assert sorted(kinds[:6]) == ["leg"] * 2 + ["post"] * 4
    assert kinds[6:] == ["beam", "floor", "floor", "wall", "wall"]
    assert not notes


STUB = part("stub", (2.0, 0.8, 3.22), (2.4, 1.2, 3.3), "IfcColumn")


def test_geometry_overrides_the_class_and_a_note_names_both() -> None:
    sill = part("sill", (1.0, 0.8, 3.32), (3.0, 1.2, 3.5), "IfcBeam")
    wall = part("wall on sill", (1.0, 0.9, 3.52), (3.0, 1.1, 6.0), "IfcWall")
    order, notes = names([*BAYS, STUB, sill, wall])
    assert order.index("floor 1") < order.index("stub") < order.index("sill") < order.index("wall on sill")
    assert notes == ("sill (beam) comes before its turn: wall on sill (wall) needs it",)


def test_a_part_is_of_the_level_of_what_it_stands_on() -> None:
    """A low tray belongs to the floor by its height, but stands on a stub on that floor."""
    order, notes = names([*BAYS, STUB, part("tray", (1.0, 0.4, 3.32), (3.0, 1.6, 3.5), "IfcSlab")])
    assert order.index("floor 2") < order.index("stub")
    assert order[-1] == "tray"
    assert not notes


def test_stated_storeys_do_not_matter() -> None:
    """Neither a floor that is stated to be above its posts or below, nor a wall in the wrong storey."""
    wrong = [
        (name, low, high, more | {"hints": dataclasses.replace(more["hints"], storey_rank=5 - n), "storey": f"{n}"})
        for n, (name, low, high, more) in enumerate(BAYS)
    ]
    assert names(wrong) == names(BAYS)


def test_without_columns_and_walls_stated_storeys_matter_only_on_one_level() -> None:
    heights = {"upper": (6.0, 0), "lower": (3.0, 1), "same": (3.0, 0)}
    parts = [
        part(name, (1 + 4 * n, 1, foot), (4 + 4 * n, 3, foot + 0.2), "IfcSlab", storey_rank=storey)
        for n, (name, (foot, storey)) in enumerate(heights.items())
    ]
    assert names(parts)[0] == ["same", "lower", "upper"]


def test_other_ranks_change_the_order_of_classes() -> None:
    slabs_first = [
        (name, low, high, more | {"hints": dataclasses.replace(more["hints"], rank=5 - more["hints"].rank)})
        for name, low, high, more in BAYS
        if more["ifc_class"] in ("IfcBeam", "IfcSlab")
    ]
    slabs_first = [*slabs_first, *(p for p in BAYS if p[3]["ifc_class"] in ("IfcColumn", "IfcWall"))]
    order, _ = names(slabs_first)
    assert max(order.index("floor 1"), order.index("floor 2")) < order.index("beam")


@pytest.fixture(scope="module")
def prefab() -> LoadedSite:
    return guess_site(read_building(PREFAB))


def upper_parts_before_their_floor(site: Site, order: tuple[int, ...]) -> tuple[int, list[str]]:
    """Return how many columns and walls stand near a slab, and which of them are set before such a slab.

    It looks at classes, boxes and the order only.
    """
    at = {component: n for n, component in enumerate(order)}
    boxes: list[NDArray[np.float64]] = [component.mesh.bounds_m for component in site.components]
    count, found = 0, []
    for i, upper in enumerate(site.components):
        if upper.ifc_class not in ("IfcColumn", "IfcWall"):
            continue
        near = []
        for j, slab in enumerate(site.components):
            aside = np.maximum(0.0, np.maximum(boxes[i][0, :2] - boxes[j][1, :2], boxes[j][0, :2] - boxes[i][1, :2]))
            level = abs(boxes[j][1, 2] - boxes[i][0, 2]) <= STEP_M
            if slab.ifc_class == "IfcSlab" and level and np.hypot(*aside) <= NEAR_M:
                near.append(j)
        count += bool(near)
        found += [f"{upper.name} before {site.components[j].name}" for j in near if at[i] < at[j]]
    return count, found


@pytest.mark.slow
def test_no_upper_column_or_wall_of_the_sample_goes_before_the_slabs_under_it(prefab: LoadedSite) -> None:
    sequence = sequence_of(prefab.site)
    assert upper_parts_before_their_floor(prefab.site, sequence.order) == (38, [])
    assert sequence.notes == ()


def test_nor_if_the_file_keeps_the_slabs_in_the_storey_below(prefab: LoadedSite) -> None:
    components = tuple(
        dataclasses.replace(c, hints=dataclasses.replace(c.hints, storey_rank=max(0, (c.hints.storey_rank or 0) - 1)))
        if c.ifc_class == "IfcSlab"
        else c
        for c in prefab.site.components
    )
    site = dataclasses.replace(prefab.site, components=components)
    assert upper_parts_before_their_floor(site, sequence_of(site).order) == (38, [])


def test_storeys_can_be_left_out(prefab: LoadedSite, tmp_path: Path) -> None:
    (tmp_path / "prefab.ifc").write_bytes(PREFAB.read_bytes())
    (tmp_path / "prefab.site.toml").write_text(prefab.to_toml().replace("storeys = true", "storeys = false"))
    site = load_site(tmp_path / "prefab.site.toml").site
    assert {component.hints.rank for component in site.components} == {None}
    contacts = Contacts(site)
    relations = precedence(site, contacts)
    kept, _ = stages(site.components, order_graph(site, relations, contacts), relations.supports)
    assert len(set(kept)) == 1
