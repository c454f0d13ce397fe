import numpy as np
import pytest
from box_buildings import box_element, building_of, frame_house
from box_sites import box_cells, box_mesh

from bimvox.bim.building import TriangleMesh
from bimvox.errors import ConfigError
from bimvox.grid.frame import GridFrame
from bimvox.site.component import StoredPose
from bimvox.site.config.site_config import ComponentConfig, ModelConfig, SiteConfig
from bimvox.site.parts import centre_of_mass_m, component_of, entries_by_id, is_erected

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
