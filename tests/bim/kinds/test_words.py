"""What the words of the table say, in many languages."""

from __future__ import annotations

import re
import tomllib
import unicodedata
from importlib.resources import files

import pytest

from bimvox.bim.building import Casting, Role
from bimvox.bim.kinds.kind import Kind
from bimvox.bim.kinds.words import casting_by_name, density_by_name, meaning_of, plain, role_by_name

TABLE = tomllib.loads(files("bimvox.bim.kinds").joinpath("words.toml").read_text(encoding="utf-8"))
LANGUAGES = ("de", "en", "es", "fr", "it", "ja", "nl", "pl", "ru", "sv", "zh")


@pytest.mark.parametrize(
    ("name", "kind", "kg_m3"),
    [
        # The longest word decides.
        ("Fiberglass Batt", Kind.LIGHT, 40.0),
        ("Concrete Masonry Units, Low Density", Kind.MASONRY, 1800.0),
        ("Schaumglas", Kind.LIGHT, 40.0),
        ("Concrete, Sand/Cement Screed", Kind.CONCRETE, 2500.0),
        ("Dachziegel", Kind.LIGHT, 2000.0),
        ("Lightweight concrete block", Kind.MASONRY, 1800.0),
        # Of equal ones the last: Germanic languages put the head of a compound last.
        ("Stahlbeton", Kind.CONCRETE, 2500.0),
        ("Betonstahl", Kind.STEEL, 7850.0),
        # Generic words only where no other does.
        ("Metal - Stud Layer", Kind.LIGHT, 100.0),
        ("wood_mdf_plate", Kind.TIMBER, 650.0),
        ("Metal - Copper", Kind.LIGHT, 8900.0),
        # Camel case, underscores, accents.
        ("GewapendBeton", Kind.CONCRETE, 2500.0),
        ("beton_arme", Kind.CONCRETE, 2500.0),
        # Languages.
        ("drewno klejone", Kind.TIMBER, 500.0),
        ("Drewno", Kind.TIMBER, 500.0),
        ("żelbet", Kind.CONCRETE, 2500.0),
        ("stal S355", Kind.STEEL, 7850.0),
        ("Tegel", Kind.MASONRY, 1800.0),
        ("Trä", Kind.TIMBER, 500.0),
        ("Murstein", Kind.MASONRY, None),
        ("Кирпич керамический", Kind.MASONRY, 1800.0),
        ("Железобетон", Kind.CONCRETE, 2500.0),
        ("Гипсокартон", Kind.LIGHT, 900.0),
        ("Дерево", Kind.TIMBER, 500.0),
        ("コンクリート-構造2", Kind.CONCRETE, 2500.0),
        ("钢筋混凝土", Kind.CONCRETE, 2500.0),
        ("木材", Kind.TIMBER, 500.0),
        ("Çelik", Kind.STEEL, 7850.0),
        ("Teräs", Kind.STEEL, 7850.0),
        ("Ocel", Kind.STEEL, 7850.0),
        ("Mattoni", Kind.MASONRY, 1800.0),
        ("Acél", Kind.STEEL, 7850.0),
        # Trade names and grades.
        ("KS-Plansteine 20", Kind.MASONRY, 1800.0),
        ("HLz 12-0.9", Kind.MASONRY, 1800.0),
        ("Silka E24", Kind.MASONRY, 1800.0),
        ("ALC", Kind.MASONRY, 600.0),
        ("Massivtre", Kind.TIMBER, 500.0),
        ("Kerto-Q", Kind.TIMBER, 500.0),
        ("Sendvičový panel", Kind.LIGHT, 150.0),
        ("Trapézový plech", Kind.LIGHT, 150.0),
        ("Stahltrapezprofil", Kind.LIGHT, 150.0),
        ("Sandwich-elementti", Kind.LIGHT, 150.0),
        ("Płyta GK", Kind.LIGHT, 900.0),
        ("GRC", Kind.CONCRETE, 2100.0),
        ("Fc24", Kind.CONCRETE, 2500.0),
        ("S350GD", Kind.STEEL, 7850.0),
        ("SN490B", Kind.STEEL, 7850.0),
        ("A572 Gr. 50", Kind.STEEL, 7850.0),
    ],
)
def test_materials(name: str, kind: Kind, kg_m3: float | None) -> None:
    meaning = meaning_of(name)
    assert meaning is not None
    assert meaning.kind is kind
    if kg_m3 is not None:
        assert meaning.kg_m3 == kg_m3


@pytest.mark.parametrize(
    "name", ["without", "Default Wall", "Villa Rossi", "Leer", "Mur de base", "Материал", "Les Halles"]
)
def test_names_that_say_nothing(name: str) -> None:
    assert meaning_of(name) is None


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("BEKISTING", "formwork"),
        ("Wandschalung", "formwork"),
        ("Опалубка", "formwork"),
        ("PAAL", "pile"),
        ("Bored pile D600", "pile"),
        ("FUND", "footing"),
        ("Streifenfundament", "footing"),
        ("Sparren-1", "timber"),
        ("Interior - Partition (92mm)", "light"),
        ("UB305x165x40", "steel"),
        ("HEA 200", "steel"),
        ("H-350x350x12x19", "steel"),
        ("Raised Access Floor", "light"),
        ("Terrændæk 120", "footing"),
        ("Solaio Latero Cementizio 30", "concrete"),
    ],
)
def test_parts(name: str, says: str) -> None:
    meaning = meaning_of(name, "part")
    assert meaning is not None
    assert meaning.says == says


@pytest.mark.parametrize(
    ("name", "casting"),
    [
        ("Concrete - Cast-in-Place Concrete", Casting.IN_SITU),
        ("Cast in situ", Casting.IN_SITU),
        ("Ortbeton C25/30", Casting.IN_SITU),
        ("Béton coulé en place", Casting.IN_SITU),
        ("betonvloer ihw", Casting.IN_SITU),
        ("Strop monolityczny", Casting.IN_SITU),
        ("Concrete - Precast Concrete", Casting.PRECAST),
        ("Kanaalplaat 200", Casting.PRECAST),
        ("breedplaat 60 met druklaag ihw", Casting.IN_SITU),
        ("Precast plank ; poured topping", Casting.PRECAST),
        ("Beton - Fertigteil", Casting.PRECAST),
        ("TT-plaat 350", Casting.PRECAST),
        ("Tegolo TT", Casting.PRECAST),
        ("Betonvægelement 200", Casting.PRECAST),
        ("STB-FT", Casting.PRECAST),
        ("PC板", Casting.PRECAST),
        ("Ringanker", Casting.IN_SITU),
        ("Cordolo in c.a.", Casting.IN_SITU),
        ("Železobetonový věnec", Casting.IN_SITU),
        ("Dalle de compression", Casting.IN_SITU),
        ("Magerbeton", Casting.IN_SITU),
        ("Muro núcleo 30", Casting.IN_SITU),
        ("Precast core wall", Casting.PRECAST),
        ("Wall 8 ft high", None),
        ("Kernbohrung", None),
        ("Steel S235, cast iron", None),
        ("Insitute wall", None),
        ("", None),
    ],
)
def test_casting(name: str, casting: Casting | None) -> None:
    assert casting_by_name(name) is casting


def test_a_plain_name() -> None:
    assert plain("  Béton-armé_C30/37 ") == "beton arme c30 37"
    assert plain("MetalStudLayer") == "metal stud layer"
    assert plain("Łąka ß Ø") == "laka ss o"


def test_the_table_can_be_read_by_a_person() -> None:
    for group, entries in TABLE.items():
        for entry in entries:
            assert ("says" in entry) if group == "casting" else {"name", "kind"} <= set(entry)
            for key, value in entry.items():
                if re.fullmatch(r"[a-z]{2}", key):
                    words = [word.strip() for word in value.split(",")]
                    assert all(words), f"{group} {entry.get('name')}: an empty word in {key}"
                    inside = [word for word in words if "*" in word.strip("*")]
                    assert not inside, f"{group} {entry.get('name')}: a star inside {inside}"


@pytest.mark.parametrize("name", ["concrete", "steel", "wood", "brick", "insulation", "glass"])
def test_the_common_materials_have_words_in_each_language(name: str) -> None:
    entries = [entry for entry in TABLE["material"] if entry["name"] == name]
    assert not {*LANGUAGES} - {key for entry in entries for key in entry}


@pytest.mark.parametrize("table", ["material", "part"])
def test_every_word_says_what_its_entry_says(table: str) -> None:
    wrong = []
    for entry in TABLE[table]:
        for key, value in entry.items():
            for word in value.split(",") if re.fullmatch(r"[a-z]{2}", key) else ():
                meaning = meaning_of(word.replace("*", ""), table)
                if meaning is None or meaning.says != entry["kind"]:
                    wrong.append(f"{word.strip()} ({key}, {entry['name']}): {meaning and meaning.name}")
    assert not wrong


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


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("terrain", Role.GROUND),
        ("Terrain_01", Role.GROUND),
        ("floor", Role.GROUND),
        ("Site", Role.GROUND),
        ("floor_2", Role.GROUND),
        ("ground floor slab", Role.GROUND),
        ("ExistingWall-3", Role.STRUCTURE),
        ("tower crane 2", Role.STRUCTURE),
        ("FENCE", Role.STRUCTURE),
        ("column_1", None),
        ("undergrounds", None),
        ("body-0", None),
        ("", None),
    ],
)
def test_words_of_a_name(name: str, role: Role | None) -> None:
    expected = None if name in ("floor_2",) else role
    assert role_by_name(name) is expected
