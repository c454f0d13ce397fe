"""The drawings of the yard, one a delivery."""

from __future__ import annotations

import re

from bimvox.rendering.report.drawings import yard_drawings

YARD = [[[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [0.0, 10.0]]]


def box(number: int, delivery: int, x: float, y: float, *, wide: float = 4.0, deep: float = 1.0) -> dict:
    return {"number": number, "delivery": delivery, "box_m": [[x, y], [x + wide, y + deep]]}


def drawn(stored, frames=()):
    return yard_drawings({"drawing": {"areas": {"yard": YARD}, "stored": list(stored), "frames": list(frames)}})


def test_each_delivery_has_its_parts_by_number_and_the_frames_of_its_racks():
    frame = {"delivery": 2, "rack": 1, "box_m": [[10.0, 1.0], [14.0, 2.0]]}
    shown = drawn(
        [box(1, 1, 1.0, 1.0), box(2, 1, 1.0, 1.0), box(3, 1, 1.0, 1.0), box(5, 1, 8.0, 1.0), box(6, 2, 1.0, 3.0)],
        [frame],
    )
    first, second = re.findall(r"<figure.*?</figure>", shown)
    assert re.findall(r"<text[^>]*>([^<]*)<", first) == ["1 to 3", "5"]
    assert re.findall(r"<text[^>]*>([^<]*)<", second) == ["6"]
    assert (first.count('class="area frame"'), second.count('class="area frame"')) == (0, 1)
    assert "frame of rack 1, delivery 2" in second


def test_numbers_stand_along_the_longer_side_at_the_middle_of_their_part():
    shown = drawn([box(7, 1, 2.0, 2.0, wide=2.0, deep=6.0)])
    x, y = (float(v) for v in re.search(r'<text x="([0-9.]+)" y="([0-9.]+)"[^>]*rotate', shown).groups())
    corners = re.search(r'd="M([0-9. L]+)Z" class="area stored"', shown)[1]
    points = [tuple(map(float, pair.split())) for pair in corners.split("L")]
    middle = [sum(axis) / 4.0 for axis in zip(*points, strict=True)]
    assert abs(x - middle[0]) < 0.02
    assert abs(y - 3.5 - middle[1]) < 0.02


def test_without_stored_parts_there_is_none_and_many_are_counted():
    assert drawn([]) == ""
    shown = drawn([box(n, n, 1.0, 1.0) for n in range(1, 31)])
    assert shown.count("<figure") == 24
    assert "6 more deliveries are not drawn" in shown
