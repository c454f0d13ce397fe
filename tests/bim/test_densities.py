from __future__ import annotations

import unicodedata

import pytest

from bimvox.bim.kinds.words import density_by_name


@pytest.mark.parametrize(
    ("name", "density"),
    [
        ("Concrete, Cast-in-Place gray", 2500),
        ("concrete_reinforced_in-situ", 2500),
        ("Stahlbeton C30/37", 2500),
        ("C35/45", 2500),
        ("CONCRETE/C53/65", 2500),
        ("02 Beton gewapend - prefab", 2500),
        ("Béton armé", 2500),
        ("Hormigón armado HA-25", 2500),
        ("Calcestruzzo C28/35", 2500),
        ("Betonstahl B500", 7850),
        ("FeB500", 7850),
        ("Porenbeton", 600),
        ("Béton cellulaire", 600),
        ("Leichtbeton LC 16/18", 1800),
        ("Masonry - Concrete Block", 1800),
        ("Metal - Steel - 345 MPa", 7850),
        ("STEEL/S235JR", 7850),
        ("S355J2", 7850),
        ("Acier S275", 7850),
        ("Acero laminado", 7850),
        ("Acciaio", 7850),
        ("Stål", 7850),
        ("Metal - Stud Layer", 100),
        ("Structure, Wood Joist/Rafter Layer, Batt Insulation", 100),
        ("metal_copper_generic", 8900),
        ("TIMBER/HOUT", 500),
        ("Madera aserrada", 500),
        ("Bois lamellé-collé", 500),
        ("Brettsperrholz (CLT)", 500),
        ("CLT 140 5s", 500),
        ("GL24h", 500),
        ("C24", 500),
        ("KVH Fichte", 500),
        ("wood_mdf_plate", 650),
        ("Eiche", 750),
        ("Masonry - Brick", 1800),
        ("Kalksandstein", 1800),
        ("stone_sand-lime", 1800),
        ("stone_granite_masonry", 2700),
        ("Ladrillo hueco", 1800),
        ("Ceramic Tile", 2300),
        ("Glass", 2500),
        ("Verre trempé", 2500),
        ("Aluminum", 2700),
        ("Aluminium 6060", 2700),
        ("99 Isolatie - EPS", 40),
        ("MISCELLANEOUS/PU", 40),
        ("Mineralwolle", 40),
        ("Laine de roche", 40),
        ("Misc. Air Layers - Air Space", 1.2),
        ("Gypsum Wall Board", 900),
        ("bulk-material_sand-coarse_generic", 1800),
        ("C30", 2500),
        ("Door - Frame", None),
        ("Default Wall", None),
        ("Default Floor", None),
        ("<Unnamed>", None),
        ("without", None),
        ("virtual_black", None),
        ("Lege arcering (2)", None),
        ("", None),
    ],
)
def test_names_in_several_languages(name: str, density: float | None) -> None:
    assert density_by_name(name) == density
    assert density_by_name(unicodedata.normalize("NFD", name).upper()) == density
