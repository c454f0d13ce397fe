import math

import numpy as np
import pytest
from box_sites import box_mesh
from hypothesis import given
from hypothesis import strategies as st

from bimvox.bim.building import Building, Element, Role, Source
from bimvox.errors import ConfigError
from bimvox.site.config.file import parse_site_config
from bimvox.site.config.template import site_toml
from bimvox.site.machine import cranes_of
from bimvox.site.map_frame import ifc_to_map, metric_scale, on_site, read_from_map, set_out
from bimvox.site.placement import place_building


def test_no_conversion_is_no_transform() -> None:
    assert ifc_to_map({"crs": "EPSG:28992"}, "m") is None


def test_a_point_on_the_x_axis_goes_where_the_axis_points() -> None:
    georeference = {"eastings_m": 1000.0, "northings_m": 2000.0, "height_m": 5.0, "x_axis_yaw_rad": math.pi / 2}
    matrix = np.array(ifc_to_map(georeference, "m"))
    assert matrix @ [10.0, 0.0, 1.0, 1.0] == pytest.approx([1000.0, 2010.0, 6.0, 1.0])


@given(
    yaw_rad=st.floats(-math.pi, math.pi),
    points=st.lists(st.tuples(*[st.floats(-100, 100)] * 3), min_size=2, max_size=2),
)
def test_distances_are_kept(yaw_rad: float, points: list[tuple[float, float, float]]) -> None:
    georeference = {"eastings_m": 1e5, "northings_m": 4e5, "height_m": 3.0, "x_axis_yaw_rad": yaw_rad, "scale": 1.0}
    matrix = np.array(ifc_to_map(georeference, "m"))
    one, other = (matrix @ [*point, 1.0] for point in points)
    assert np.linalg.norm(one - other) == pytest.approx(np.linalg.norm(np.subtract(*points)), abs=1e-6)


@pytest.mark.parametrize(
    ("stated", "unit", "scale"),
    [(1.0, "mm", 1.0), (0.001, "mm", 1.0), (0.9996, "m", 0.9996), (0.3048, "ft", 1.0), (0.0009996, "mm", 0.9996)],
)
def test_the_scale_is_read_in_metres(stated: float, unit: str, scale: float) -> None:
    assert metric_scale(stated, unit) == pytest.approx(scale)


def test_a_surveyor_gets_every_crane_area_and_zone_on_the_map() -> None:
    georeference = {"eastings_m": 1000.0, "northings_m": 2000.0, "height_m": 5.0, "x_axis_yaw_rad": math.pi / 2}
    to_map = ifc_to_map(georeference, "m")
    assert to_map is not None
    text = """
        areas = { construction = [[0, 0], [10, 0], [10, 5]], yard = [[[20, 0], [30, 0], [30, 5]]], access = [ACCESS] }
        crane = { name = "west", machine = "flat-top-75", base_m = [1, 2, 0.5] }
        zone = [{ kind = "prohibited", name = "street", polygon = [[0, -9], [4, -9], [4, -5]] }]
        model = { path = "a.ifc" }"""
    config = parse_site_config(text.replace("ACCESS", "[[20, 5], [30, 5], [30, 9]]"), "site.toml")
    site_to_ifc = np.eye(4)
    site_to_ifc[2, 3] = -1.0
    found = set_out(config, cranes_of(config), site_to_ifc, to_map)
    # The site's x axis points north, so its y axis points west, and north is a right turn from it.
    assert found["north_deg"] == -90.0
    assert found["cranes"] == {"west": [998.0, 2001.0, 4.5]}
    assert found["construction"][1] == [1000.0, 2010.0, 4.0]
    assert found["yard"] == [[[1000.0, 2020.0, 4.0], [1000.0, 2030.0, 4.0], [995.0, 2030.0, 4.0]]]
    assert found["access"] == [[[995.0, 2020.0, 4.0], [995.0, 2030.0, 4.0], [991.0, 2030.0, 4.0]]]
    assert found["zones"] == [
        {
            "kind": "prohibited",
            "name": "street",
            "corners": [[1009.0, 2000.0, 4.0], [1009.0, 2004.0, 4.0], [1005.0, 2004.0, 4.0]],
        }
    ]
    assert np.array(found["site_to_map"]) @ [1.0, 2.0, 0.5, 1.0] == pytest.approx([998.0, 2001.0, 4.5, 1.0])


MAP_FILE = """
    coordinates = "map"
    areas = { construction = [[1000, 2000], [1000, 2010], [995, 2010]], yard = [YARD], access = [YARD], plot = YARD }
    crane = { machine = "flat-top-75", base_m = [998, 2001, 4.5] }
    zone = [{ kind = "prohibited", polygon = [[1009, 2000], [1009, 2004], [1005, 2004]] }]
    model = { path = "a.ifc", ground_m = -1.0 }
""".replace("YARD", "[[1000, 2020], [1000, 2030], [995, 2030]]")
TO_MAP = {"eastings_m": 1000.0, "northings_m": 2000.0, "height_m": 5.0, "x_axis_yaw_rad": math.pi / 2, "scale": 0.9996}


def building(**georeference: float) -> Building:
    box = Element("a", "a", "IfcBeam", "a", box_mesh((0.0, 0.0, 0.0), (2.0, 1.0, 1.0)), Role.COMPONENT, 1.0, "")
    return Building((box,), (), Source("a.ifc", "", "IFC4", "m"), georeference=georeference)


def test_areas_zones_and_cranes_are_read_in_map_coordinates() -> None:
    given = parse_site_config(MAP_FILE, "site.toml")
    found = read_from_map(given, building(**TO_MAP | {"scale": 1.0}))
    assert found.coordinates == "site"
    assert found.areas.construction == ((0.0, 0.0), (10.0, 0.0), (10.0, 5.0))
    assert found.areas.yard == (((20.0, 0.0), (30.0, 0.0), (30.0, 5.0)),)
    assert found.areas.access == found.areas.yard
    assert found.areas.plot == found.areas.yard[0]
    assert found.one_crane is not None
    assert found.one_crane.base_m == (1.0, 2.0, 0.5)
    assert found.zone[0].polygon == ((0.0, -9.0), (4.0, -9.0), (4.0, -5.0))
    assert read_from_map(found, building()) is found
    assert parse_site_config(site_toml(given), "site.toml").coordinates == "map"
    assert parse_site_config(site_toml(found), "site.toml").coordinates == "site"


@given(yaw_deg=st.floats(-180, 180), model_yaw_rad=st.floats(-3, 3), scale=st.sampled_from([1.0, 0.9996]))
def test_what_is_read_from_the_map_is_set_out_there_again(yaw_deg: float, model_yaw_rad: float, scale: float) -> None:
    given = parse_site_config(MAP_FILE.replace("ground_m", f"yaw_deg = {yaw_deg!r}, ground_m"), "site.toml")
    georeference = TO_MAP | {"x_axis_yaw_rad": model_yaw_rad, "scale": scale}
    model = building(**georeference)
    found = read_from_map(given, model)
    _, site_to_ifc = place_building(found, model)
    to_map = ifc_to_map(georeference, "m")
    assert to_map is not None
    told = set_out(found, cranes_of(found), site_to_ifc, to_map)
    assert told["cranes"]["flat-top-75"] == pytest.approx([998.0, 2001.0, 4.5], abs=2e-3)
    for corner, wanted in zip(told["construction"], [[1000, 2000], [1000, 2010], [995, 2010]], strict=True):
        assert corner[:2] == pytest.approx(wanted, abs=2e-3)
    assert on_site(given, site_to_ifc, to_map) == found


@pytest.mark.parametrize(
    ("text", "georeference", "key", "words"),
    [
        (MAP_FILE, {}, "coordinates", "no map conversion"),
        (MAP_FILE, TO_MAP | {"eastings_m": 2e5}, "areas.construction", "199 km from the building"),
        (MAP_FILE.replace(", ground_m = -1.0", ""), TO_MAP, "crane.base_m", "needs the height of the ground"),
    ],
)
def test_what_cannot_be_on_the_map_is_refused(text: str, georeference: dict[str, float], key: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words) as caught:
        read_from_map(parse_site_config(text, "site.toml"), building(**georeference))
    assert caught.value.key == key
