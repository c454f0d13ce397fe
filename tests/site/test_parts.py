import numpy as np
import pytest
from box_buildings import box_element, building_of, frame_house
from box_sites import box_cells, box_mesh
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.bim.building import TriangleMesh
from bimvox.errors import ConfigError
from bimvox.grid.frame import GridFrame
from bimvox.site.component import (
    StoredPose,
    erection_size_vox,
    shape_of,
    stored_shape,
    turned_aside,
    turned_hook,
    turned_shape,
    turning_columns,
)
from bimvox.site.config.site_config import (
    ComponentConfig,
    ModelConfig,
    RanksConfig,
    SequenceConfig,
    SiteConfig,
    ZoneConfig,
)
from bimvox.site.parts import (
    centre_of_mass_m,
    component_of,
    entries_by_id,
    first_ids,
    is_erected,
    order_hints,
    sail_area_m2,
)

FRAME = GridFrame((0.0, 0.0, -0.5), 0.5)


def site(*entries: ComponentConfig) -> SiteConfig:
    return SiteConfig(model=ModelConfig(path="a.ifc"), component=entries)


def merged(*meshes: TriangleMesh) -> TriangleMesh:
    counts = np.cumsum([0, *(len(mesh.vertices_m) for mesh in meshes)])
    return TriangleMesh(
        np.concatenate([mesh.vertices_m for mesh in meshes]),
        np.concatenate([mesh.faces + n for mesh, n in zip(meshes, counts, strict=False)]).astype(np.int32),
    )


@pytest.mark.parametrize(
    ("ifc_class", "high", "erected"),
    [
        ("IfcColumn", (1, 1, 4), True),
        ("IfcColumn", (2, 1, 4), True),
        ("IfcColumn", (2.1, 1, 4), False),
        ("IfcPile", (0.3, 0.3, 9), True),
        ("Mesh", (0.3, 0.3, 3), True),
        ("IfcWall", (1, 0.2, 3), False),
        ("IfcBeam", (0.3, 0.3, 3), False),
    ],
)
def test_slender_uprights_are_erected(ifc_class, high, erected):
    assert is_erected(box_element("a", (0, 0, 0), high, ifc_class=ifc_class)) is erected


def test_the_centre_of_mass_is_of_the_volume_whatever_the_triangles():
    l_shape = merged(box_mesh((0, 0, 0), (4, 1, 1)), box_mesh((0, 1, 0), (1, 2, 1)))
    np.testing.assert_allclose(centre_of_mass_m(l_shape), [(4 * 2 + 0.5) / 5, (4 * 0.5 + 1.5) / 5, 0.5])
    inverted = TriangleMesh(l_shape.vertices_m, l_shape.faces[:, ::-1])
    np.testing.assert_allclose(centre_of_mass_m(inverted), centre_of_mass_m(l_shape))
    box = box_mesh((0, 0, 0), (1, 1, 1))
    assert centre_of_mass_m(TriangleMesh(box.vertices_m * [1, 1, 0], box.faces)) is None


def test_the_hook_is_above_the_centre_of_mass_inside_the_box():
    element = box_element("a", (2, 1, 1), (6, 2, 2))
    cells = box_cells(FRAME, (2, 1, 1), (6, 2, 2))
    component = component_of(0, element, cells, None, FRAME)
    assert component.target_vox == (4, 2, 3)
    assert component.shape.size_vox == (8, 2, 2)
    assert component.hook_offset_vox == (4, 1, 2)
    flat = box_mesh((0, 0, 0), (4, 4, 1))
    sheet = TriangleMesh(flat.vertices_m * [1, 1, 0], flat.faces)
    l_cells = [(i, 0, 1) for i in range(8)] + [(0, j, 1) for j in range(8)]
    hook = component_of(0, box_element("b", (0, 0, 0), (4, 4, 0.1)), np.array(l_cells), None, FRAME).hook_offset_vox
    assert hook == (4, 4, 1)
    without_volume = element.__class__(**{**_fields(element), "mesh": sheet})
    assert component_of(0, without_volume, np.array(l_cells), None, FRAME).hook_offset_vox == (2, 2, 1)


def test_a_hook_in_the_middle_of_its_cell_has_no_sign():
    """The centre of mass may be some 1e-16 before the middle: a log keeps no negative zero."""
    high = float(np.nextafter(0.5, 0.0))
    component = component_of(
        0, box_element("a", (0, 0, 0), (high, high, 1)), box_cells(FRAME, (0, 0, 0), (0.5, 0.5, 1)), None, FRAME
    )
    assert repr(component.hook_aside_vox) == "(0.0, 0.0)"


def _fields(element):
    return {name: getattr(element, name) for name in element.__slots__}


def test_what_the_site_file_says_of_a_part():
    column = box_element("c", (0, 0, 0), (0.5, 0.5, 3), ifc_class="IfcColumn")
    cells = box_cells(FRAME, (0, 0, 0), (0.5, 0.5, 3))
    entry = ComponentConfig(global_id="c", start=(3.0, 4.2), pose=StoredPose.LYING_Y, before=("x",), after=("y",))
    component = component_of(3, column, cells, entry, FRAME)
    assert component.start_vox == (6, 8, 1)
    assert component.stored_pose is StoredPose.LYING_Y
    assert (component.before, component.after) == (("x",), ("y",))
    assert component.erected
    as_built = ComponentConfig(global_id="c", pose=StoredPose.AS_BUILT)
    assert not component_of(3, column, cells, as_built, FRAME).erected


def test_entries_are_found_by_id_or_global_id():
    twice = [box_element(f"g#{n}", (n, 0, 0), (n + 1, 1, 1), global_id="g") for n in (1, 2)]
    building = building_of(*frame_house().elements, *twice, box_element("h#7", (0, 0, 9), (1, 1, 10), global_id="h"))
    entries = entries_by_id(
        site(
            ComponentConfig(global_id="slab", after=("h",)),
            ComponentConfig(global_id="h"),
            ComponentConfig(global_id="g#2"),
        ),
        building.elements,
    )
    assert list(entries) == ["slab", "h#7", "g#2"]
    assert entries["slab"].after == ("h#7",)
    with pytest.raises(ConfigError, match="several parts") as caught:
        entries_by_id(site(ComponentConfig(global_id="g")), building.elements)
    assert caught.value.available == ("g#1", "g#2")


@pytest.mark.parametrize(
    ("entries", "key", "said"),
    [
        ((ComponentConfig(global_id="slub"),), "component[0].global_id", "'slab'"),
        ((ComponentConfig(global_id="footing"),), "component[0].global_id", "no component"),
        ((ComponentConfig(global_id="slab", after=("beam-9",)),), "component[0].after", "'beam-1'"),
        (
            (ComponentConfig(global_id="slab", before=("beam-0",)), ComponentConfig(global_id="slab2")),
            "component[1].global_id",
            "slab",
        ),
        (
            (
                ComponentConfig(global_id="slab", before=("beam-0",)),
                ComponentConfig(global_id="beam-0", before=("slab",)),
            ),
            "component",
            "cycle",
        ),
        (
            (ComponentConfig(global_id="slab", after=("beam-0",)), ComponentConfig(global_id="beam-0", pinned=True)),
            "component[0]",
            "pinned",
        ),
    ],
)
def test_invalid_entries_are_refused(entries, key, said):
    with pytest.raises(ConfigError, match=said) as caught:
        entries_by_id(site(*entries), frame_house().elements)
    assert caught.value.key == key


def joined(*meshes: TriangleMesh) -> TriangleMesh:
    faces = [mesh.faces + sum(len(m.vertices_m) for m in meshes[:n]) for n, mesh in enumerate(meshes)]
    return TriangleMesh(np.concatenate([m.vertices_m for m in meshes]), np.concatenate(faces).astype(np.int32))


def box(low, high) -> TriangleMesh:
    return box_element("b", low, high).mesh


def test_a_wall_shows_its_face_and_a_slab_its_edge():
    # Every 5 degrees: the outline of a box of 6 x 0.2 x 3 is at most slightly larger than its face.
    assert sail_area_m2(box((0, 0, 0), (6, 0.2, 3))) == pytest.approx(6.0 * 3.0, rel=0.01)
    slab = sail_area_m2(box((0, 0, 0), (6, 2, 0.2)))
    assert 0.2 * 6.0 < slab <= 0.2 * np.hypot(6, 2) + 1e-9


def test_a_column_that_is_tipped_up_shows_its_side_lying_too():
    assert sail_area_m2(box((0, 0, 0), (0.4, 0.4, 5))) == pytest.approx(5 * 0.4 * 2**0.5, rel=0.01)
    assert sail_area_m2(box((0, 0, 0), (3, 0.4, 0.4)), tipped=True) == pytest.approx(3 * 0.4 * 2**0.5, rel=0.02)


def test_inner_faces_do_not_count():
    shells = joined(*(box((0.1 * n, 0.1 * n, 0.1 * n), (4, 1, 2)) for n in range(6)))
    assert sail_area_m2(shells) == pytest.approx(sail_area_m2(box((0, 0, 0), (4, 1, 2))), rel=1e-6)


def test_two_posts_show_no_more_than_their_faces():
    posts = joined(box((0, 0, 0), (0.2, 0.2, 3)), box((5, 0, 0), (5.2, 0.2, 3)))
    assert sail_area_m2(posts) == pytest.approx(2 * 3 * 0.2 * 2**0.5, rel=0.01)


PARTS = [
    box_element("a", (0, 0, 0), (1, 1, 1), storey_height_m=3.0, task="lay", task_rank=4, assembly="frame"),
    box_element("b", (5, 0, 0), (6, 1, 1), storey_height_m=0.0),
    box_element("c", (20, 0, 0), (21, 1, 1)),
]
EAST = ((4.0, -1.0), (8.0, -1.0), (8.0, 2.0), (4.0, 2.0))
WEST = ((-2.0, -1.0), (4.0, -1.0), (4.0, 2.0), (-2.0, 2.0))


def hints_of(zones=(), **sequence):
    config = SiteConfig(model=ModelConfig(path="a.ifc"), zone=zones, sequence=SequenceConfig(**sequence))
    return order_hints(config, PARTS, first_ids(config, PARTS), [("b", "a"), ("a", "elsewhere")])


def test_storeys_count_from_below_and_tasks_and_connections_are_passed_on():
    hints = hints_of()
    assert [hints[n].storey_rank for n in "abc"] == [1, 0, None]
    assert (hints["a"].task, hints["a"].task_rank, hints["a"].assembly) == ("lay", 4, "frame")
    assert hints["a"].connected == ("b", "elsewhere")
    assert hints["c"].connected == ()


def test_storeys_and_the_schedule_can_be_left_out():
    hint = hints_of(storeys=False, schedule=False)["a"]
    assert (hint.storey_rank, hint.task, hint.task_rank) == (None, None, None)


def test_assembly_zones_count_in_the_order_of_the_file_and_prohibited_ones_do_not():
    zones = (
        ZoneConfig(polygon=WEST),
        ZoneConfig(kind="assembly", polygon=EAST, name="east"),
        ZoneConfig(kind="assembly", polygon=WEST),
    )
    hints = hints_of(zones)
    assert [(hints[n].zone, hints[n].zone_name) for n in "abc"] == [(1, "assembly zone 2"), (0, "east"), (None, None)]


def test_an_unknown_first_part_is_named_by_its_key():
    assert hints_of(first=("c",))["c"].first
    with pytest.raises(ConfigError, match=r"sequence.first\[1\]: no component has the id 'd'"):
        hints_of(first=("c", "d"))


def test_a_part_has_the_rank_of_its_class_unless_storeys_are_left_out():
    ranks = RanksConfig(column=7, beam=4)
    post = box_element("post", (0, 0, 0), (0.4, 0.4, 3), ifc_class="IfcColumn")
    beam = box_element("beam", (0, 0, 3), (6, 0.4, 3.5), ifc_class="IfcBeam")
    for sequence, wanted in (
        (SequenceConfig(ranks=ranks), [7, 4]),
        (SequenceConfig(), [1, 2]),
        (SequenceConfig(ranks=ranks, storeys=False), [None, None]),
    ):
        config = SiteConfig(model=ModelConfig(path="a.ifc"), sequence=sequence)
        hints = order_hints(config, [post, beam], frozenset(), [])
        assert [hints[name].rank for name in ("post", "beam")] == wanted


cells = st.lists(
    st.tuples(st.integers(-3, 3), st.integers(-3, 3), st.integers(-3, 3)), min_size=1, max_size=20, unique=True
)
lying = st.sampled_from([StoredPose.LYING_X, StoredPose.LYING_Y])


def as_set(shape):
    return {tuple(cell) for cell in shape.cells.tolist()}


@given(cells)
@settings(deadline=None)
def test_shape_keeps_cells_and_reference_is_the_lowest_corner(some):
    shape, reference = shape_of(some)
    assert {tuple(np.add(cell, reference)) for cell in shape.cells.tolist()} == set(some)
    assert shape.cells.min(axis=0).tolist() == [0, 0, 0]
    assert shape.size_vox == tuple((shape.cells.max(axis=0) + 1).tolist())
    filled = [
        (x, y, z)
        for x0, y0, z0, x1, y1, z1 in shape.boxes.tolist()
        for x in range(x0, x1)
        for y in range(y0, y1)
        for z in range(z0, z1)
    ]
    assert len(filled) == len(set(filled)) == len(some)
    assert set(filled) == as_set(shape)


@given(cells, lying)
@settings(deadline=None)
def test_a_lying_shape_is_the_same_shape_turned_with_its_foot_at_the_low_end(some, pose):
    shape, _ = shape_of(some)
    turned = stored_shape(shape, pose)
    axis = 0 if pose is StoredPose.LYING_X else 1
    assert len(turned.cells) == len(shape.cells)
    assert turned.size_vox[axis] == shape.size_vox[2]
    assert turned.size_vox[2] == shape.size_vox[axis]
    # A layer at height z in the building is z cells from the low end: the foot is at the lowest index.
    for z in range(shape.size_vox[2]):
        assert (shape.cells[:, 2] == z).sum() == (turned.cells[:, axis] == z).sum()


@given(cells)
@settings(deadline=None)
def test_as_built_is_left_alone(some):
    shape, _ = shape_of(some)
    assert stored_shape(shape, StoredPose.AS_BUILT) is shape


@given(cells, st.sampled_from(list(StoredPose)))
@settings(deadline=None)
def test_the_erection_box_contains_the_stored_and_the_raised_upright_pose(some, pose):
    shape, _ = shape_of(some)
    box = np.array(erection_size_vox(shape, pose))
    assert (np.array(stored_shape(shape, pose).size_vox) <= box).all()
    assert (np.add(shape.size_vox, [0, 0, 1]) <= box).all()


@pytest.mark.parametrize("pose", [StoredPose.LYING_X, StoredPose.LYING_Y])
def test_the_erection_box_contains_every_angle_between(pose):
    length, width = 7, 3
    shape, _ = shape_of(np.argwhere(np.ones((width, width, length), bool)))
    reach_x, reach_y, reach_z = erection_size_vox(shape, pose)
    reach = reach_x if pose is StoredPose.LYING_X else reach_y
    for angle in np.linspace(0.0, np.pi / 2, 50):
        corners = np.array([[0, 0], [length, 0], [0, width], [length, width]]) @ np.array(
            [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
        )
        extent = np.ptp(corners, axis=0)
        assert extent[0] <= reach
        assert extent[1] <= reach_z


def test_the_papers_column():
    column, reference = shape_of([(7, 7, z) for z in range(1, 5)])
    assert reference == (7, 7, 1)
    assert stored_shape(column, StoredPose.LYING_X).size_vox == (4, 1, 1)
    assert stored_shape(column, StoredPose.LYING_Y).size_vox == (1, 4, 1)
    assert erection_size_vox(column, StoredPose.LYING_X) == (4, 1, 5)


@given(st.integers(0, 3), st.integers(0, 3), st.integers(1, 4), st.integers(1, 4))
def test_turning_by_quarters_keeps_cells_around_the_hook(turn, more, size_x, size_y):
    cells = np.argwhere(np.ones((size_x, size_y, 2), bool))[: size_x * size_y * 2 - 1]
    shape, _ = shape_of(cells)
    hook = (size_x // 2, size_y // 2, 2)
    once, at = turned_shape(shape, turn), turned_hook(shape, hook, turn)
    twice = turned_shape(once, more)
    assert np.array_equal(twice.cells, turned_shape(shape, (turn + more) % 4).cells)
    assert turned_hook(once, at, more) == turned_hook(shape, hook, (turn + more) % 4)
    away = sorted(((shape.cells[:, :2] - hook[:2]) ** 2).sum(axis=1).tolist())
    assert sorted(((once.cells[:, :2] - at[:2]) ** 2).sum(axis=1).tolist()) == away


def test_a_part_turns_within_the_circle_of_its_corners():
    shape, _ = shape_of(np.argwhere(np.ones((9, 1, 1), bool)))
    columns = {tuple(c) for c in turning_columns(shape, (4.0, 0.0, 1.0), 1).tolist()}
    assert {(x, 0) for x in range(9)} <= columns
    assert {(4, y) for y in range(-4, 5)} <= columns
    assert (7, 3) in columns
    assert not {(0, 4), (8, -4)} & columns


def test_a_part_with_its_hook_aside_of_a_cell_is_first_moved_to_where_it_turns():
    shape, _ = shape_of(np.argwhere(np.ones((9, 1, 1), bool)))
    straight = {tuple(c) for c in turning_columns(shape, (4.0, 0.0, 1.0), 1).tolist()}
    columns = {tuple(c) for c in turning_columns(shape, (4.3, -0.2, 1.0), 2).tolist()}
    assert straight < columns
    # Its hook is 0.72 cells away from there as it lies, and its far corner 4.85 cells from its hook.
    assert (10, 0) in columns
    assert not {(11, 0), (4, 8)} & columns
    assert turned_aside((0.3, -0.2), 1) == (0.2, 0.3)
    assert turned_aside((0.3, -0.2), 2) == (-0.3, 0.2)
