from __future__ import annotations

import pytest

from bimvox.bim.densities import density_by_name


@pytest.mark.parametrize(
    ("name", "density"),
    [
        ("Concrete, Cast-in-Place gray", 2500),
        ("Stahlbeton C30/37", 2500),
        ("CONCRETE/C53/65", 2500),
        ("02 Beton gewapend - prefab", 2500),
        ("Betonstahl B500", 7850),
        ("Porenbeton", 600),
        ("Metal - Steel - 345 MPa", 7850),
        ("STEEL/S235JR", 7850),
        ("TIMBER/HOUT", 500),
        ("GL24h", 500),
        ("Masonry - Brick", 1800),
        ("Glass", 2500),
        ("Aluminum", 2700),
        ("99 Isolatie - EPS", 40),
        ("Default Wall", None),
        ("without", None),
        ("", None),
    ],
)
def test_names_in_several_languages(name: str, density: float | None) -> None:
    assert density_by_name(name) == density
