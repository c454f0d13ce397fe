"""One frame in three files: the same parts with the same geometry in different units, schemas and origins."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.util.element
import ifcopenshell.util.unit
import numpy as np
import pytest

from sample_models.frame import RD_NEW_ORIGIN_M

ORIGINS_M = {
    "frame.ifc": (0, 0, 0),
    "frame_ifc2x3_mm.ifc": (0, 0, 0),
    "frame_georeferenced.ifc": RD_NEW_ORIGIN_M,
}


@pytest.mark.parametrize("name", list(ORIGINS_M))
def test_variants_have_the_same_parts_in_the_same_places(
    samples: Path, name: str, shapes_of: Callable[[Path], dict[str, Any]]
) -> None:
    plain, variant = shapes_of(samples / "frame.ifc"), shapes_of(samples / name)
    assert list(plain) == list(variant)
    for global_id, part in plain.items():
        other = variant[global_id]
        assert (part.name, part.ifc_class) == (other.name, other.ifc_class)
        np.testing.assert_allclose(other.bounds_m - ORIGINS_M[name], part.bounds_m, atol=1e-6)


def test_it_is_written_in_other_units_and_another_schema(samples: Path) -> None:
    file = ifcopenshell.open(samples / "frame_ifc2x3_mm.ifc")
    assert file.schema == "IFC2X3"
    assert ifcopenshell.util.unit.calculate_unit_scale(file) == pytest.approx(0.001)
    owner = file.by_type("IfcColumn")[0].OwnerHistory
    assert owner.OwningUser.TheOrganization.Name == "bimvox"


def test_georeferenced_frame_lies_far_from_its_origin(samples: Path) -> None:
    file = ifcopenshell.open(samples / "frame_georeferenced.ifc")
    placement = file.by_type("IfcSite")[0].ObjectPlacement.RelativePlacement.Location.Coordinates
    assert placement == RD_NEW_ORIGIN_M
    (conversion,) = file.by_type("IfcMapConversion")
    assert conversion.TargetCRS.Name == "EPSG:28992"
    # These are map coordinates already: applying the conversion again would put the frame in the sea.
    assert (conversion.Eastings, conversion.Northings) == (0.0, 0.0)


def test_beams_bear_on_the_column_heads_and_not_on_each_other(
    samples: Path, shapes_of: Callable[[Path], dict[str, Any]]
) -> None:
    parts = list(shapes_of(samples / "frame.ifc").values())
    columns = [part.bounds_m for part in parts if part.ifc_class == "IfcColumn"]
    beams = [part.bounds_m for part in parts if part.ifc_class == "IfcBeam"]
    for low, high in beams:
        assert low[2] == pytest.approx(3.0)
        bearings = [
            np.minimum(high[:2], column[1, :2]) - np.maximum(low[:2], column[0, :2])
            for column in columns
            if np.all(np.minimum(high[:2], column[1, :2]) > np.maximum(low[:2], column[0, :2]))
        ]
        assert len(bearings) == 2
        assert all(bearing.min() > 0.089 for bearing in bearings)
    for i, first in enumerate(beams):
        for second in beams[i + 1 :]:
            gap = np.maximum(first[0] - second[1], second[0] - first[1])[:2].max()
            assert gap > 0.0099


def test_only_the_long_beams_state_their_weight(samples: Path) -> None:
    file = ifcopenshell.open(samples / "frame.ifc")
    said = {
        beam.Name: ifcopenshell.util.element.get_psets(beam, qtos_only=True).get("Qto_BeamBaseQuantities", {})
        for beam in file.by_type("IfcBeam")
    }
    assert said["Beam 1"]["GrossWeight"] == pytest.approx(0.3 * 0.5 * 6.4 * 2400)
    assert said["Beam A"] == {}
