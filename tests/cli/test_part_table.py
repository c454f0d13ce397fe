from __future__ import annotations

import io
from typing import Any

from bimvox_cli.part_table import show_parts
from rich.console import Console


def part(name: str, **values: Any) -> dict[str, Any]:
    return {
        "id": f"id-{name}",
        "ifc_class": "IfcBeam",
        "name": name,
        "role": "component",
        "material": "Steel",
        "mass_kg": 1234.5678,
        "mass_source": "quantity",
        "cells": 1000,
        "solid_volume_m3": 0.5,
        "fill_fraction": 0.256,
        "fill": "winding",
        "boxes": 3,
        "shared_cells": 7,
    } | values


def shown(parts: list[dict[str, Any]], width: int = 160) -> list[list[str]]:
    stream = io.StringIO()
    show_parts(Console(file=stream, width=width, markup=False, highlight=False), parts)
    assert "\x1b" not in stream.getvalue()
    return [line.split() for line in stream.getvalue().splitlines()]


def test_few_parts_are_listed_with_their_sum() -> None:
    head, one, two, total, hint = shown([part("b1"), part("b2", mass_kg=0.25, mass_source="default")])
    assert " ".join(head) == ("class name id role material kg mass from cells m3 % full filled by boxes shared")
    assert " ".join(one) == "IfcBeam b1 id-b1 component Steel 1,235 quantity 1,000 0.5 26 winding 3 7"
    assert two[5:7] == ["0.25", "default"]
    assert " ".join(hint).startswith("mass from default: the model has no weight")
    assert " ".join(total) == "total 1,235 2,000 1 6"


def test_a_narrow_terminal_gets_the_columns_that_matter() -> None:
    head, *_ = shown([part("b1")], width=80)
    assert " ".join(head) == "class name id role kg mass from cells m3 % full"


def test_bodies_of_a_mesh_have_no_ids_next_to_their_names() -> None:
    head, *_ = shown([part("b1", id="b1", material=None)])
    assert "id" not in head
    assert "material" not in head


def test_many_parts_are_grouped_by_class() -> None:
    beams = [part(f"b{n}", mass_source="density" if n else "quantity") for n in range(20)]
    head, group, other, total = shown([*beams, part("w", ifc_class="IfcWall", role="structure")])
    assert " ".join(head) == "class role parts kg mass from cells m3 boxes"
    assert " ".join(group) == "IfcBeam component 20 24,691 density 19, quantity 1 20,000 10 60"
    assert other[:3] == ["IfcWall", "structure", "1"]
    assert " ".join(total) == "total 21 25,926 21,000 10.5 63"


def test_very_many_classes_are_cut_and_all_are_summed() -> None:
    lines = shown([part(str(n), ifc_class=f"Ifc{n}") for n in range(25)])
    assert lines[-2][:2] == ["total", "25"]
    assert " ".join(lines[-1]).startswith("... and 5 more classes")
