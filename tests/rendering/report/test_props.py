"""The drawing of the props of a storey: every number stands clear of others, of feet, and where it can of lines."""

import re

from bimvox.rendering.report.props import _storey
from bimvox.rendering.report.sheet import Label

FOOT_PX = 2.5


def storey(feet: list[tuple[float, float]], size_m: float = 14.0) -> str:
    walls = [[(0.0, 0.0), (size_m, 0.0), (size_m, 0.2), (0.0, 0.2), (0.0, 0.0)]]
    props = [
        {"number": n + 10, "head_m": [x, y + 1.5, 2.0], "foot_m": [x, y, 0.0], "type": "push-pull prop"}
        for n, (x, y) in enumerate(feet)
    ]
    return _storey({"storey": "Ground floor", "uprights": [walls], "props": props})


def numbers(html: str) -> list[Label]:
    found = re.findall(
        r'<text x="([\d.-]+)" y="([\d.-]+)"[^>]*?text-anchor="(\w+)" class="label halo">(\d\d)</text>', html
    )
    return [Label(words, (float(x), float(y)), anchor) for x, y, anchor, words in found]


def feet_px(html: str) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"[^>]*prop foot', html)]


def apart(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]


def test_no_number_covers_another_one_or_a_foot():
    html = storey([(x, y) for x in (2.0, 3.1, 4.2, 12.0) for y in (5.0, 6.1, 7.2)])
    labels, feet = numbers(html), feet_px(html)
    assert len(labels) == len(feet) == 12
    for n, label in enumerate(labels):
        assert all(apart(label.box, other.box) for other in labels[:n])
        for x, y in feet:
            assert apart(label.box, (x - FOOT_PX, y - FOOT_PX, x + FOOT_PX, y + FOOT_PX))
    assert "without room" not in html


def test_a_number_keeps_off_the_line_of_another_prop_if_it_can():
    html = storey([(5.0, 5.0), (5.0, 3.4)])  # above the second foot is the first one's, above that its line
    assert len(numbers(html)) == 2
    heads = re.findall(r'<line x1="([\d.]+)" y1="([\d.]+)" x2="[\d.]+" y2="([\d.]+)" class="prop"', html)
    for x, top, bottom in ((float(x), float(top), float(bottom)) for x, top, bottom in heads):
        assert all(apart(label.box, (x, top, x, bottom)) for label in numbers(html))


def test_numbers_without_room_are_counted_and_the_table_has_them():
    html = storey([(5.0 + 0.02 * n, 5.0 + 0.02 * n) for n in range(40)])
    missing = 40 - len(numbers(html))
    assert missing > 0
    assert f"{missing} numbers without room: the table below has every foot" in html
