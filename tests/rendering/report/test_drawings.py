"""The drawings are measured: their lengths, divided by the scale, are those of the log."""

from __future__ import annotations

import dataclasses
import json
import math
import re

import numpy as np
import pytest
import shapely
from log_building import tiny_log
from opened_pages import EVIL, evil_log, revision_of
from report_reading import ReadReport

from bimvox.crane.kinematics import hook_of
from bimvox.crane.load_chart import capacity_kg
from bimvox.grid.frame import Label
from bimvox.rendering.report.drawings import drawings
from bimvox.rendering.report.page import report_page
from bimvox.rendering.report.plan_view import _crane_names, plan_parts
from bimvox.rendering.report.record import record_of
from bimvox.rendering.report.sheet import sheet_for
from bimvox.rendering.report.site_plan import drawing_of

PX_PER_MM = 96.0 / 25.4


def drawn(log=None, **metadata: str) -> tuple[dict, str]:
    revision = revision_of(log or tiny_log(crane=True))
    revision = dataclasses.replace(revision, metadata={**revision.metadata, **metadata})
    drawing = drawing_of(revision)
    return drawing, drawings({"drawing": drawing})


def svgs(html: str) -> list[str]:
    return re.findall(r"<svg width=.*?</svg>", html)


def numbers(svg: str, tag: str, class_: str, *keys: str) -> list[list[float]]:
    found = [one for one in re.findall(rf"<{tag} [^>]*>", svg) if f'class="{class_}"' in one]
    return [[float(re.search(rf' {key}="([-0-9.]+)"', one).group(1)) for key in keys] for one in found]


def test_the_radii_and_the_jib_measure_what_the_crane_has():
    log = tiny_log(crane=True)
    crane = log.plan.site.cranes[0]
    drawing, html = drawn(log)
    plan = svgs(html)[0]
    scale = int(re.search(r"Plan, 1 : (\d+)", plan).group(1))
    per_m = 1000.0 * PX_PER_MM / scale
    circles = numbers(plan, "circle", "ring", "cx", "cy", "r")
    wanted = [radius_m for radius_m, _ in drawing["cranes"][0]["rings"]]
    assert [r / per_m for _, _, r in circles] == pytest.approx(wanted, abs=0.02 * scale / 1000)
    assert wanted[0] == crane.min_radius_m
    assert wanted[-1] == crane.jib_length_m
    for radius_m, mass_kg in drawing["cranes"][0]["rings"]:
        assert mass_kg == capacity_kg(crane.chart, radius_m)
        assert f"{radius_m:g} m: {mass_kg / 1000:.2f} t" in plan
    ((_, _, sweep),) = numbers(plan, "circle", "area oversail", "cx", "cy", "r")
    assert sweep / per_m == pytest.approx(crane.jib_length_m + crane.mast_size_m / 2, abs=0.01)
    ((x1, x2, length_m),) = numbers(plan, "line", "bar scale-bar", "x1", "x2", "data-length-m")
    assert (x2 - x1) / per_m == pytest.approx(length_m, abs=0.01)


def test_the_stated_scale_holds_on_paper_and_every_drawing_fits_the_page():
    _, html = drawn()
    found = svgs(html)
    assert len(found) == 4
    for svg in found:
        width, height = (float(one) for one in re.search(r'width="([\d.]+)" height="([\d.]+)"', svg).groups())
        box = [float(one) for one in re.search(r'viewBox="([\d. ]+)"', svg).group(1).split()]
        assert box[2:] == [width, height]  # a unit of the drawing is a CSS pixel
        assert width / PX_PER_MM <= 275.0
        assert height / PX_PER_MM <= 172.0


def test_the_crane_stands_at_its_coordinates_on_the_grid():
    log = tiny_log(crane=True)
    _, html = drawn(log)
    plan = svgs(html)[0]
    ((cx, cy, _),) = numbers(plan, "circle", "area oversail", "cx", "cy", "r")
    marks = re.findall(r'<text x="([\d.]+)" y="([\d.]+)" text-anchor="(middle|end)" class="label tick">(-?\d+)<', plan)
    across = [(float(x), float(value)) for x, _, anchor, value in marks if anchor == "middle"]
    upwards = [(float(y) - 4.0, float(value)) for _, y, anchor, value in marks if anchor == "end"]
    x_m, y_m, _ = log.plan.site.cranes[0].base_m
    for at, pairs, wanted in ((cx, across, x_m), (cy, upwards, y_m)):
        slope, offset = np.polyfit(*np.array(pairs).T, 1)
        assert slope * at + offset == pytest.approx(wanted, abs=0.02)


def test_areas_and_outlines_are_those_of_the_log():
    log = tiny_log(crane=True)
    site = log.plan.site
    size_m = site.frame.voxel_size_m
    drawing, _ = drawn(log)

    def area(rings):
        return sum(shapely.Polygon(ring).area for ring in rings)

    assert area(drawing["areas"]["yard"]) == pytest.approx(np.count_nonzero(site.yard) * size_m**2)
    construction = np.count_nonzero(site.labels[:, :, 0] == Label.CONSTRUCTION_AREA)
    assert area(drawing["areas"]["construction"]) == pytest.approx(construction * size_m**2)
    (truck,) = drawing["obstructions"]
    assert truck["id"] == "truck-7"
    assert truck["box_m"] == [[5.0, -1.0, 0.0], [6.0, 1.0, 2.0]]
    tops = [component.mesh.bounds_m[1, 2] for component in site.components]
    assert max(one["high_m"] for one in drawing["storeys"]) == pytest.approx(max(tops), abs=1e-3)
    assert {one["number"] for one in drawing["stored"]} == {lift.number for lift in log.planned}


def test_distances_are_measured_independently():
    log = tiny_log(crane=True)
    site = log.plan.site
    drawing, html = drawn(log)
    found = {one["name"]: one["distance_m"] for one in drawing["distances_m"]}
    (crane,) = site.cranes
    mast = shapely.Point(crane.base_m[:2]).buffer(crane.mast_size_m / 2.0, cap_style="square")
    parts = shapely.union_all([shapely.box(*c.mesh.bounds_m[:, :2].ravel()) for c in site.components])
    yard = shapely.box(-2.0, -3.0, 2.0, 7.0)
    wanted = {
        f"test crane, mast's face to {what}": mast.distance(to) for what, to in (("building", parts), ("yard", yard))
    }
    wanted["building to yard"] = parts.distance(yard)
    assert found == pytest.approx(wanted, abs=1e-3)
    for value in found.values():
        assert f"{value:.2f} m" in html


def test_every_part_of_a_load_is_above_the_exclusion_zone_while_it_hangs():
    log = tiny_log(crane=True)
    site = log.plan.site
    drawing, _ = drawn(log)
    zone = shapely.union_all([shapely.Polygon(ring) for ring in drawing["below_loads"]]).buffer(0.1)
    for motion in log.motions:
        points = site.components[motion.component].mesh.vertices_m[:, :2]
        crane, path = site.cranes[motion.crane], motion.loaded
        hooks = hook_of(crane, path.slew_rad, path.radius_m, path.height_m)[:, :2]
        for hook in hooks:
            assert shapely.contains_xy(zone, *(points + hook - hooks[-1]).T).all()


@pytest.mark.parametrize(
    ("stated", "kind", "angle_deg"),
    [
        ({"true_north_rad": 0.5}, "true north", 90.0 + math.degrees(0.5)),
        ({"x_axis_yaw_rad": 0.25}, "map north", 90.0 - math.degrees(0.25)),
    ],
)
def test_the_north_arrow_points_where_the_model_says(stated, kind, angle_deg):
    drawing, html = drawn(georeference=json.dumps(stated))
    assert drawing["north"]["kind"] == kind
    assert math.degrees(drawing["north"]["angle_rad"]) == pytest.approx(angle_deg)
    turned = float(re.search(r'class="north" transform="rotate\(([-\d.]+)\)"', html).group(1))
    assert 90.0 - turned == pytest.approx(angle_deg, abs=1e-3)


@pytest.mark.parametrize("width_m", [1.0, 12.0, 30.0, 300.0])
def test_the_scale_bar_does_not_reach_the_north_arrow(width_m):
    north = {"kind": "true north", "angle_rad": 0.0}
    drawing = drawn()[0] | {"extent_m": [[0.0, 0.0, 0.0], [width_m, 50.0, 5.0]], "north": north}
    sheet, parts = plan_parts(drawing, detail=True)
    words = re.search(r'<text x="([\d.]+)" [^>]*>(\d+ m · 1 : \d+)</text>', "".join(parts))
    arrow = re.search(r"translate\(([\d.]+) 24\)", "".join(parts))
    assert float(words.group(1)) + 5.4 * len(words.group(2)) < float(arrow.group(1)) - 18.0
    assert sheet.size_px[0] <= 1030.0


def test_unknown_north_is_said_and_damaged_metadata_are_no_north():
    for text in ("{}", "[]", "not json", '{"true_north_rad": "up"}'):
        drawing, html = drawn(georeference=text)
        assert drawing["north"] is None
        assert "does not state north" in html


def test_names_stay_text_and_a_site_without_a_crane_is_drawn():
    assert EVIL not in drawn(evil_log())[1]
    record = record_of(revision_of(tiny_log(crane=False)))
    read = ReadReport(report_page(record, ()))
    assert read.record["drawing"]["cranes"] == []
    assert "Drawings" in read.text


@pytest.mark.parametrize(("x_m", "anchor"), [(0.0, "middle"), (-49.0, "start"), (49.0, "end")])
def test_the_name_of_a_crane_near_the_border_begins_inside_the_sheet(x_m, anchor):
    crane = {"name": "crane", "base_m": [x_m, 0.0, 0.0], "mast_m": 2.0, "tail_m": 5.0, "jib_m": [20.0, 19.0, 21.0]}
    sheet = sheet_for((-50.0, -50.0), (50.0, 50.0), (1030.0, 640.0))
    label, *_ = _crane_names(sheet, crane, 0.0)
    assert label.anchor == anchor


def test_distances_are_drawn_where_they_do_not_cover_each_other():
    whole, detail, *_ = svgs(drawn()[1])
    assert "dimension" not in whole
    assert detail.count('class="dimension"') == 3


def test_no_line_of_the_plan_covers_the_labels_of_the_crane():
    for plan in svgs(drawn()[1])[:2]:
        labels = [one.start() for one in re.finditer(r'class="label halo ringed"', plan)]
        lines = [one.start() for one in re.finditer(r'class="(jib|ring|tail|mast|dimension|area [a-z]+)"', plan)]
        assert labels
        assert lines
        assert min(labels) > max(lines)


def test_the_reach_of_a_falling_load_is_not_cut_off_by_the_sheet():
    drawing = drawn()[0] | {"falling_loads": [[[-300.0, -200.0], [400.0, -200.0], [400.0, 500.0]]]}
    plan = svgs(drawings({"drawing": drawing}))[0]
    width, height = (float(one) for one in re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', plan).groups())
    (outline,) = re.findall(r'd="M([^"]*)Z" class="area falling"', plan)
    for corner in outline.split("L"):
        x, y = (float(one) for one in corner.split())
        assert 0.0 < x < width
        assert 0.0 < y < height


@pytest.mark.parametrize(("towards_rad", "above"), [(math.pi / 2.0, False), (1.5 * math.pi, True)])
def test_the_name_of_a_crane_is_on_the_other_side_of_the_mast_than_its_jib(towards_rad, above):
    crane = {"name": "crane", "base_m": [0.0, 0.0, 0.0], "mast_m": 2.0, "rings": []}
    sheet = sheet_for((-50.0, -50.0), (50.0, 50.0), (1030.0, 640.0))
    label, *_ = _crane_names(sheet, crane, towards_rad)
    assert (label.at[1] < sheet.at((0.0, 0.0))[1]) is above
