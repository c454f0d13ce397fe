from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from log_building import FRAME, tiny_plan
from named_cranes import HAMMERHEADS, LUFFING_CRANES

from bimvox.crane.links import HOOK_BLOCK_M, counter_jib_m, urdf
from bimvox.crane.outline import outline_of
from bimvox.crane.tower_crane import CranePose, TowerCrane
from bimvox.log.scene import STATE_RGBA, SceneUpdates, component_frame
from bimvox.log.transforms import voxel_grid
from bimvox.rendering.pictures.cranes import crane_parts
from bimvox.site.component import ConstructionState

UNBUILT, IN_TRANSIT, ASSEMBLED = ConstructionState.UNBUILT, ConstructionState.IN_TRANSIT, ConstructionState.ASSEMBLED


def scene() -> SceneUpdates:
    plan = tiny_plan()
    return SceneUpdates(plan.site, {lift.component: lift for lift in plan.lifts}, {})


def cells_of(entity: object) -> set[tuple[int, int, int]]:
    found = set()
    for cube in entity.cubes:  # type: ignore[attr-defined]
        size = np.array([cube.size.x, cube.size.y, cube.size.z])
        low = np.array([cube.pose.position.x, cube.pose.position.y, cube.pose.position.z]) - size / 2
        first, last = FRAME.cells_over(low, low + size)
        found |= {tuple(int(n) for n in first + np.array(step)) for step in np.ndindex(*(last - first))}
    return found


def test_a_change_sends_only_what_changes() -> None:
    made = scene()
    first = made.change({0: UNBUILT, 1: UNBUILT}, 0)
    assert [entity.id for entity in first.entities] == ["0GlobalIdColumnA", "0GlobalIdColumnB"]
    assert made.change({0: UNBUILT, 1: UNBUILT}, 1) is None
    assert made.change({}, 2) is None
    second = made.change({0: ASSEMBLED, 1: None}, 5_000_000_001)
    assert [entity.id for entity in second.entities] == ["0GlobalIdColumnA"]
    assert [gone.id for gone in second.deletions] == ["0GlobalIdColumnB"]
    assert (second.entities[0].timestamp.seconds, second.entities[0].timestamp.nanos) == (5, 1)


def test_boxes_are_where_the_state_says() -> None:
    made = scene()
    site = made.site
    lying = made.change({0: UNBUILT}, 0).entities[0]
    assert lying.frame_id == "site"
    assert cells_of(lying) == {(0, 0, 1), (1, 0, 1), (2, 0, 1)}
    moving = made.change({0: IN_TRANSIT}, 0).entities[0]
    assert moving.frame_id == component_frame("0GlobalIdColumnA")
    size = moving.cubes[0].size
    assert (size.x, size.y, size.z) == (1.0, 1.0, 3.0)
    assert moving.cubes[0].pose.position.z == 1.5
    built = made.change({0: ASSEMBLED}, 0).entities[0]
    target = np.array(site.components[0].target_vox)
    assert cells_of(built) == {tuple(int(n) for n in target + cell) for cell in site.components[0].shape.cells}
    assert (built.cubes[0].color.r, built.cubes[0].color.g) == STATE_RGBA[ASSEMBLED][:2]


def test_fixed_things_cover_exactly_their_cells() -> None:
    made = scene()
    entities = {entity.id: entity for entity in made.fixed(0).entities}
    assert set(entities) == {
        "ground",
        "construction_area",
        "obstruction/truck-7",
        "0GlobalIdWall",
        "crane/jib",
        "crane/trolley",
        "crane/hook",
    }
    ground, area = cells_of(entities["ground"]), cells_of(entities["construction_area"])
    assert not ground & area
    assert ground | area == {tuple(map(int, cell)) for cell in made.site.blockers[0].cells}
    black = entities["obstruction/truck-7"].cubes[0].color
    assert (black.r, black.g, black.b, black.a) == (0.0, 0.0, 0.0, 1.0)


def test_voxel_data_is_z_y_x() -> None:
    site = tiny_plan().site
    grid = voxel_grid(site, 7)
    data = np.frombuffer(grid.data, np.uint8)
    assert len(data) % grid.slice_stride == 0
    layers = data.reshape(-1, grid.row_count, grid.column_count)
    assert layers.shape == (5, 10, 12)  # the four empty layers at the top are omitted
    expected = site.labels.copy()
    for part in site.components:
        expected[tuple((part.shape.cells + part.target_vox).T)] = 6
    assert (layers == expected.transpose(2, 1, 0)[:5]).all()
    assert (grid.pose.position.x, grid.pose.position.y, grid.pose.position.z) == FRAME.origin_m
    offset = 3 * grid.slice_stride + 2 * grid.row_stride + 7 * grid.cell_stride
    assert grid.data[offset] == expected[7, 2, 3]


def crane_sizes_m(crane: TowerCrane) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return the lowest corner and the size of what the log shows of each link."""
    made = scene()
    made.site = replace(made.site, cranes=(crane,))
    found = {}
    for entity in made.fixed(0).entities:
        if entity.id.startswith("crane/"):
            sizes = np.array([(cube.size.x, cube.size.y, cube.size.z) for cube in entity.cubes])
            at = np.array([(c.pose.position.x, c.pose.position.y, c.pose.position.z) for c in entity.cubes])
            low, high = (at - sizes / 2).min(axis=0), (at + sizes / 2).max(axis=0)
            found[entity.id] = (low, high - low)
    return found


def urdf_boxes(crane: TowerCrane) -> dict[str, list[float]]:
    robot = ET.fromstring(urdf(crane))
    return {
        str(shape.get("name")): [float(number) for number in shape.find("geometry/box").get("size").split()]  # type: ignore[union-attr]
        for shape in robot.iter("visual")
    }


@pytest.mark.parametrize("crane", [*HAMMERHEADS, *LUFFING_CRANES], ids=lambda crane: crane.name)
def test_log_robot_and_picture_draw_the_hook_block_of_the_same_size(crane: TowerCrane) -> None:
    pose = CranePose(0.0, 0.5 * (crane.min_radius_m + crane.jib_length_m), 8.0)
    drawn = next(block for block in crane_parts(crane, pose).blocks if np.allclose(block.centre_m[2], 8.5))
    assert crane_sizes_m(crane)["crane/hook"][1] == pytest.approx(HOOK_BLOCK_M)
    assert urdf_boxes(crane)["hook"] == pytest.approx(HOOK_BLOCK_M)
    assert 2.0 * drawn.half_m.sum(axis=0) == pytest.approx(HOOK_BLOCK_M)


@pytest.mark.parametrize("crane", HAMMERHEADS, ids=lambda crane: crane.name)
def test_log_robot_picture_and_separation_have_one_counter_jib(crane: TowerCrane) -> None:
    back_m = -crane_sizes_m(crane)["crane/jib"][0][0]
    blocks = crane_parts(replace(crane, base_m=(0.0, 0.0, 0.0)), CranePose(0.0, 10.0, 8.0)).blocks
    drawn_m = max(float(np.abs(block.half_m[:, 0]).sum() - block.centre_m[0]) for block in blocks)
    assert back_m == pytest.approx(counter_jib_m(crane))
    assert urdf_boxes(crane)["counter_jib"][0] == pytest.approx(counter_jib_m(crane))
    assert drawn_m == pytest.approx(counter_jib_m(crane))
    assert outline_of(crane).tail_m == counter_jib_m(crane)
