"""The drawing of a site is measured: its lengths, divided by its scales, are those of the site file."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import ImageFont

from bimvox.bim.building import Building, Role
from bimvox.bim.read import read_building
from bimvox.crane.load_chart import capacity_kg
from bimvox.rendering.report.drawing_file import drawing_file
from bimvox.rendering.report.plan_view import plan_parts
from bimvox.rendering.report.sheet import width_px
from bimvox.rendering.report.site_drawing import drawing_of_site
from bimvox.site.config.site_config import ModelConfig, SiteConfig, ZoneConfig
from bimvox.site.guess import guess_site
from bimvox.site.machine import crane_of
from bimvox.site.map_frame import ifc_to_map
from bimvox.site.placement import place_building

SAMPLES = Path(__file__).parents[3] / "sample_models"
SVG = "{http://www.w3.org/2000/svg}"
PX_PER_M = 96.0 / 0.0254
HOSTILE = '</text><script>alert("1")</script>&\ufffe\x07' + "'" * 3 + "x" * 300


def sample(name: str) -> tuple[SiteConfig, Building]:
    building = read_building(SAMPLES / name)
    return guess_site(building, ModelConfig(path=Path(name))), building


@pytest.fixture(scope="module")
def prefab() -> tuple[SiteConfig, Building]:
    return sample("prefab.ifc")


@pytest.fixture(scope="module")
def on_map() -> tuple[SiteConfig, Building]:
    return sample("frame_georeferenced.ifc")


def drawn(config: SiteConfig, building: Building, name: str = "site") -> ElementTree.Element:
    return ElementTree.fromstring(drawing_file(drawing_of_site(config, building), name))


def views(svg: ElementTree.Element) -> list[tuple[int, ElementTree.Element]]:
    scales = [int(one.text.rsplit(" ", 1)[1].replace(",", "")) for one in classed(svg, "text", "view")]
    return list(zip(scales, classed(svg, "g", "sheet"), strict=True))


def classed(inside: ElementTree.Element, tag: str, class_: str) -> list[ElementTree.Element]:
    return [one for one in inside.iter(SVG + tag) if one.get("class") == class_]


def at(element: ElementTree.Element, *keys: str) -> list[float]:
    return [float(element.get(key, "")) for key in keys]


def metres(view: ElementTree.Element, scale: int, point: list[float]) -> list[float]:
    """Return a point in metres, by the labels of the grid."""
    found = []
    for axis, (key, anchor) in enumerate((("x", "middle"), ("y", "end"))):
        ticks = [one for one in classed(view, "text", "label tick") if one.get("text-anchor") == anchor]
        first = ticks[0]
        at_px = float(first.get(key, "")) - (4.0 if axis else 0.0)
        found.append(float(first.text or "") + (-1) ** axis * (point[axis] - at_px) * scale / PX_PER_M)
    return found


def labels(view: ElementTree.Element) -> list[ElementTree.Element]:
    return [one for one in view.iter(SVG + "text") if (one.get("class") or "").startswith("label halo")]


def test_the_crane_stands_where_the_file_says_and_its_rings_are_those_of_its_load_chart(
    prefab: tuple[SiteConfig, Building],
) -> None:
    crane = crane_of(prefab[0])
    assert crane is not None
    for scale, view in views(drawn(*prefab)):
        rings = [at(one, "cx", "cy", "r") for one in classed(view, "circle", "ring")]
        tips = [one.find(SVG + "title").text for one in classed(view, "circle", "ring")]
        for (x, y, r), words in zip(rings, tips, strict=True):
            assert metres(view, scale, [x, y]) == pytest.approx(crane.base_m[:2], abs=0.01)
            radius_m, tonnes = re.fullmatch(r"([\d.]+) m: ([\d.]+) t", words).groups()
            assert r * scale / PX_PER_M == pytest.approx(float(radius_m), abs=0.01)
            assert float(tonnes) == pytest.approx(capacity_kg(crane.chart, float(radius_m)) / 1000.0, abs=0.005)
        assert max(r for _, _, r in rings) * scale / PX_PER_M == pytest.approx(crane.jib_length_m, abs=0.01)
    overview = views(drawn(*prefab))[0][1]
    shown = [one.text for one in labels(overview) if one.get("class") == "label halo ringed"]
    assert len(shown) == len(classed(overview, "circle", "ring"))


def test_yard_and_construction_area_have_their_corners_of_the_file(prefab: tuple[SiteConfig, Building]) -> None:
    config, building = prefab
    road = ((20.0, -20.0), (24.0, -20.0), (24.0, 8.0), (20.0, 8.0))
    areas = config.areas.model_copy(update={"access": (road,)})
    for scale, view in views(drawn(config.model_copy(update={"areas": areas}), building)):
        for kind, polygons in (("construction", [areas.construction]), ("yard", areas.yard), ("access", [road])):
            (path,) = classed(view, "path", f"area {kind}")
            corners = [[float(n) for n in pair.split()] for pair in re.split("[MLZ]+", path.get("d"))[1:-1]]
            found = {tuple(round(n, 1) for n in metres(view, scale, one)) for one in corners}
            assert found == {corner for polygon in polygons or () for corner in polygon}


def test_dimensions_are_as_long_as_they_say(prefab: tuple[SiteConfig, Building]) -> None:
    scale, view = views(drawn(*prefab))[1]
    found = 0
    for group in view.iter(SVG + "g"):
        title = group.find(SVG + "title")
        lines = classed(group, "line", "dimension")
        if title is not None and len(lines) == 1:
            x0, y0, x1, y1 = at(lines[0], "x1", "y1", "x2", "y2")
            said = float((title.text or "").rsplit(": ", 1)[1].removesuffix(" m"))
            assert np.hypot(x1 - x0, y1 - y0) * scale / PX_PER_M == pytest.approx(said, abs=0.01)
            found += 1
    assert found == 5


def test_the_heaviest_parts_are_named_with_their_masses_and_marked(prefab: tuple[SiteConfig, Building]) -> None:
    svg = drawn(*prefab)
    heaviest = max(prefab[1].elements, key=lambda one: one.mass_kg if one.role.value == "component" else 0.0)
    names = [one.text or "" for one in classed(svg, "text", "heaviest")]
    assert names[0].endswith(f", {heaviest.mass_kg / 1000.0:.2f} t")
    assert any(one.name in names[0] for one in prefab[1].elements if one.mass_kg == pytest.approx(heaviest.mass_kg))
    marked = [one.text for one in labels(views(svg)[1][1])]
    assert f"1: {heaviest.mass_kg / 1000.0:.2f} t" in marked
    masses = [float(re.search(r", ([\d.,]+) t$", one).group(1)) for one in names]
    assert masses == sorted(masses, reverse=True)


def test_the_survey_grid_has_the_coordinates_of_the_map(on_map: tuple[SiteConfig, Building]) -> None:
    config, building = on_map
    matrix = np.array(ifc_to_map(building.georeference, building.source.unit)) @ place_building(config, building)[1]
    for scale, view in views(drawn(config, building)):
        lines = classed(view, "line", "survey")
        values = [one for one in view.iter(SVG + "text") if "surveyed" in (one.get("class") or "")]
        assert {(one.text or "")[0] for one in values} == {"E", "N"}
        eastings, northings = set(), set()
        for one in lines:
            ends = [metres(view, scale, at(one, *keys)) for keys in (("x1", "y1"), ("x2", "y2"))]
            (e0, n0), (e1, _) = ((matrix @ [x, y, 0.0, 1.0])[:2] for x, y in ends)
            (eastings.add(round(e0)) if abs(e0 - e1) < 0.05 else northings.add(round(n0)))
        assert {int(one.text[2:]) for one in values if one.text[0] == "E"} <= eastings
        assert {int(one.text[2:]) for one in values if one.text[0] == "N"} <= northings


@pytest.mark.parametrize("name", ["prefab.ifc", "frame_georeferenced.ifc", "hall.ifc"])
def test_no_text_leaves_the_sheet_and_no_name_covers_another(name: str) -> None:
    config, building = sample(name)
    svg = drawn(config, building, "a long name of a site " * 20)
    width, height = at(svg, "width", "height")
    for one in svg.iter(SVG + "text"):
        if not (one.get("class") or "").startswith("label"):
            size = {"title": 16.0, "view": 12.0}.get(one.get("class") or "", 10.0)
            assert float(one.get("x", "")) + ImageFont.load_default(size).getlength(one.text) <= width
            assert float(one.get("y", "")) <= height
    drawing = drawing_of_site(config, building)
    for detail in (False, True):
        sheet, parts = plan_parts(drawing, detail=detail)
        view = ElementTree.fromstring(f'<svg xmlns="{SVG[1:-1]}">{"".join(parts)}</svg>')
        boxes = {one.text: box(one) for one in labels(view)}
        for x0, y0, x1, y1 in boxes.values():
            assert x0 >= 0.0
            assert y0 >= 0.0
            assert x1 <= sheet.size_px[0]
            assert y1 <= sheet.size_px[1]
        if detail:
            for (one, a), (other, b) in combinations(boxes.items(), 2):
                assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1], (one, other)


def box(label: ElementTree.Element) -> tuple[float, float, float, float]:
    x, y = at(label, "x", "y")
    wide = width_px(label.text or "")
    left = x - {"start": 0.0, "middle": 0.5, "end": 1.0}[label.get("text-anchor", "")] * wide
    return left, y - 9.0, left + wide, y


def test_hostile_names_stay_text(prefab: tuple[SiteConfig, Building]) -> None:
    config, building = prefab
    renamed = replace(building, elements=tuple(replace(one, name=HOSTILE, storey=HOSTILE) for one in building.elements))
    zone = ZoneConfig(polygon=((0, 20), (5, 20), (5, 25)), name="<b>&")
    svg = drawn(config.model_copy(update={"zone": (zone,)}), renamed, HOSTILE)
    assert {one.tag.removeprefix(SVG) for one in svg.iter()} <= {
        "svg", "title", "style", "g", "path", "line", "rect", "circle", "text", "clipPath"
    }  # fmt: skip
    assert "<b>&" in [one.text for one in svg.iter(SVG + "text")]


def test_zones_are_drawn_by_what_they_forbid(prefab: tuple[SiteConfig, Building]) -> None:
    config, building = prefab
    zones = (
        ZoneConfig(kind="public", polygon=((60, 0), (70, 0), (70, 10), (60, 10)), name="street"),
        ZoneConfig(kind="slow", polygon=((-20, 0), (-10, 0), (-10, 10))),
    )
    drawing = drawing_of_site(config.model_copy(update={"zone": zones}), building)
    assert set(drawing["areas"]) == {"construction", "yard", "access", "prohibited", "no_load", "slow"}
    assert drawing["areas"]["prohibited"] == drawing["areas"]["no_load"]
    assert [one["name"] for one in drawing["zones"]] == ["street"]
    (x0, _, _), (x1, _, _) = drawing["extent_m"]
    assert x0 <= -20.0
    assert x1 >= 70.0


def test_the_file_needs_nothing_else_and_every_class_has_its_style(on_map: tuple[SiteConfig, Building]) -> None:
    data = drawing_file(drawing_of_site(*on_map), "site").decode()
    assert re.findall(r"https?://[^\s\"]*", data) == ["http://www.w3.org/2000/svg"]
    assert not re.search(r"url\((?!#)|@import|href=", data)
    assert "prefers-color-scheme: dark" in data
    used = {name for one in re.findall(r'class="([^"]*)"', data) for name in one.split()}
    bare = {name for name in used if not re.search(rf"\.{name}\b", data.split("</style>")[0])}
    assert bare <= {"drawing", "sheet", "heaviest", "end", "north", "scale-bar"}  # the ink of the page


def test_two_views_of_the_same_scale_are_one_with_all_names() -> None:
    config, building = sample("hall.ifc")
    around = ((-90, -90), (90, -90), (90, 90), (60, 90), (60, -60), (-90, -60))  # its name is far from all others
    zone = ZoneConfig(polygon=around, name="the street")
    ((_, view),) = views(drawn(config.model_copy(update={"zone": (zone,)}), building))
    shown = {one.text for one in labels(view)}
    assert "the street" in shown
    assert any((one or "").startswith("1: ") for one in shown)
    assert classed(view, "line", "dimension")


def test_a_site_that_is_too_large_for_a_grid_is_drawn(prefab: tuple[SiteConfig, Building]) -> None:
    config, building = prefab
    far = ZoneConfig(polygon=((50_000, 50_000), (60_000, 50_000), (60_000, 60_000)), name="far away")
    model = config.model.model_copy(update={"voxel_size_m": 0.01})
    svg = drawn(config.model_copy(update={"zone": (far,), "model": model}), building)
    assert "far away" in {one.text for one in labels(views(svg)[-1][1])}


def test_the_yard_is_outside_the_construction_area(prefab: tuple[SiteConfig, Building]) -> None:
    config, building = prefab
    assert config.areas.construction is not None
    areas = config.areas.model_copy(update={"yard": (((-20, -20), (30, -20), (30, 30), (-20, 30)),)})
    rings = drawing_of_site(config.model_copy(update={"areas": areas}), building)["areas"]["yard"]
    assert len(rings) == 2
    assert {tuple(corner) for corner in rings[1]} == set(config.areas.construction)


def test_a_site_without_a_crane_is_one_view() -> None:
    config, building = sample("frame.ifc")
    none: dict[str, Any] = {"kind": "none"}
    without = SiteConfig.model_validate(config.model_dump() | {"crane": none})
    assert len(views(drawn(without, building))) == 1


def test_the_excavation_is_drawn_and_the_ground_is_said(prefab: tuple[SiteConfig, Building]) -> None:
    config, building = prefab
    assert "excavation" not in drawing_of_site(config, building)["areas"]
    raised = config.model_copy(update={"model": config.model.model_copy(update={"ground_m": 1.0})})
    drawing = drawing_of_site(raised, building)
    corners = np.concatenate([np.array(ring) for ring in drawing["areas"]["excavation"]])
    parts = [one.mesh.bounds_m for one in building.elements if one.role is Role.COMPONENT]
    below = np.array([bounds_m for bounds_m in parts if bounds_m[0, 2] < 1.0])
    np.testing.assert_allclose(corners.min(axis=0), below[:, 0, :2].min(axis=0) - 1.0, atol=1e-3)
    np.testing.assert_allclose(corners.max(axis=0), below[:, 1, :2].max(axis=0) + 1.0, atol=1e-3)
    text = drawing_file(drawing, "site").decode()
    assert "the ground is at 1.00 m in the model" in text
    assert "excavation" in text
    assert "the lowest part of the model" in drawing_file(drawing_of_site(config, building), "site").decode()
