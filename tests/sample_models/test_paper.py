from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bimvox.site.config.file import load_site_config
from bimvox.site.site import Rules


def test_slab_and_column_fill_the_papers_cells(samples: Path, shapes_of: Callable[[Path], dict[str, Any]]) -> None:
    parts = {part.ifc_class: part.bounds_m for part in shapes_of(samples / "paper.ifc").values()}
    np.testing.assert_allclose(parts["IfcSite"], [[0, 0, -1], [15, 15, 0]], atol=1e-9)
    np.testing.assert_allclose(parts["IfcColumn"], [[7, 7, 0], [8, 8, 4]], atol=1e-9)


def test_site_file_is_the_papers_world(samples: Path, shapes_of: Callable[[Path], dict[str, Any]]) -> None:
    config = load_site_config(samples / "paper.site.toml")
    assert config.model.voxel_size_m == 1.0
    assert config.grid is not None
    assert (config.grid.low_m, config.grid.high_m) == ((0, 0), (15, 15, 5))
    assert config.areas.construction == ((5, 5), (10, 5), (10, 10), (5, 10))
    assert config.crane is not None
    assert config.crane.kind == "none"
    assert config.rules.rules() == Rules()
    (column,) = config.component
    assert column.global_id in shapes_of(config.model.path)
    assert column.pose == "lying_x"
    # It is in the yard: all of its cells are outside the construction area and inside the site.
    assert column.start is not None
    x, y = column.start[:2]
    assert x >= 0
    assert x + 4 <= 15
    assert not (5 <= y < 10) or x + 4 <= 5 or x >= 10
