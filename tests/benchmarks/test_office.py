"""The benchmark's building is deterministic and made of closed solids."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest

from benchmarks.voxelize import prisms
from benchmarks.voxelize.office import i_section, office, wall_with_openings
from benchmarks.voxelize.solids import blob, cube, terrain
from bimvox.bim.building import Building, TriangleMesh
from bimvox.voxelization.lattice import cell_count


@pytest.fixture(scope="module")
def whole() -> Building:
    return office()


def solid(mesh: TriangleMesh) -> manifold3d.Manifold:
    return manifold3d.Manifold(manifold3d.Mesh64(mesh.vertices_m, mesh.faces.astype(np.uint64)))


def test_office_is_as_large_as_its_description_says(whole: Building):
    assert 1000 <= len(whole.elements) <= 2000
    assert sum(len(element.mesh.faces) for element in whole.elements) == 76_236
    assert cell_count(whole.bounds_m, 0.1) == pytest.approx(30e6, rel=0.02)
    assert cell_count(whole.bounds_m, 0.05) == pytest.approx(240e6, rel=0.02)


def test_office_is_the_same_every_time(whole: Building):
    again = office()
    assert [element.id for element in again.elements] == [element.id for element in whole.elements]
    assert len({element.id for element in whole.elements}) == len(whole.elements)
    for one, two in zip(whole.elements, again.elements, strict=True):
        assert one.mesh.vertices_m.tobytes() == two.mesh.vertices_m.tobytes()
        assert one.mesh.faces.tobytes() == two.mesh.faces.tobytes()


def test_every_part_of_the_office_is_a_closed_solid_facing_outward(whole: Building):
    for element in whole.elements:
        body = solid(element.mesh)
        assert body.status() == manifold3d.Error.NoError, element.id
        assert body.volume() > 0.0, element.id
        assert body.volume() == pytest.approx(element.mesh.signed_volume_m3, rel=1e-9), element.id


def test_office_has_thin_parts_round_parts_and_parts_off_the_axes(whole: Building):
    thinnest = [np.ptp(element.mesh.bounds_m, axis=0).min() for element in whole.elements]
    assert min(thinnest) < 0.013
    glass = next(element for element in whole.elements if element.name.startswith("wing-glass"))
    # A pane is 8 mm thick: if its box is thicker along every axis, the pane is at an angle.
    assert np.ptp(glass.mesh.bounds_m, axis=0).min() > 0.1
    assert any(element.name.startswith("column") and len(element.mesh.faces) > 40 for element in whole.elements)


@pytest.mark.parametrize("building", [cube(2.0), blob(3.0, sides=8), terrain(20.0, 4.0, sides=12)])
def test_dense_solids_are_closed_and_solid(building: Building):
    (element,) = building.elements
    body = solid(element.mesh)
    assert body.status() == manifold3d.Error.NoError
    assert body.genus() == 0
    assert body.volume() == pytest.approx(element.mesh.signed_volume_m3)
    assert body.volume() > 0.4 * np.prod(np.ptp(element.mesh.bounds_m, axis=0))


def test_shapes_have_the_volumes_of_their_drawings():
    assert prisms.box((1.0, 2.0, 3.0)).signed_volume_m3 == pytest.approx(6.0)
    wall = wall_with_openings(4.0, 3.0, 0.2, [(1.0, 2.0, 0.0, 2.1), (2.5, 3.5, 0.9, 2.1)])
    assert wall.signed_volume_m3 == pytest.approx(0.2 * (12.0 - 2.1 - 1.2))
    assert i_section(0.36, 0.17, 0.008, 0.0127, 5.0).signed_volume_m3 == pytest.approx(
        5.0 * (2 * 0.17 * 0.0127 + 0.008 * (0.36 - 2 * 0.0127))
    )
    square_pipe = prisms.pipe(0.1, 0.02, 2.0, 4)
    assert square_pipe.signed_volume_m3 == pytest.approx(2.0 * 2 * (0.1**2 - 0.08**2))
