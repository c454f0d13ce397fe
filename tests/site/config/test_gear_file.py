import math
import re
from importlib import resources
from pathlib import Path

import pytest

from bimvox.crane.gear import GearKind
from bimvox.errors import ConfigError
from bimvox.site.config.gear_file import GEAR_FILES, gear_catalogue

OWN = """
name = "our chains"
kind = "chain_sling"
about = "tags of 2026"
lengths_m = [3, 5]
size = [{ name = "10 mm", wll_kg = 3150, kg_per_m = 2.2 }, { name = "16 mm", wll_kg = 8000, kg_per_m = 5.6 }]
"""


def test_the_catalogue_has_every_kind_and_says_where_its_figures_come_from():
    assert {family.kind for family in gear_catalogue()} == set(GearKind)
    folder = resources.files("bimvox") / "crane" / "gear_catalogue"
    for file in folder.iterdir():
        text = file.read_text(encoding="utf-8")
        assert re.search(r"^#  \[1\] ", text, re.MULTILINE), file.name
        assert "[1]" in text[text.index("name =") :], file.name


def test_the_chain_of_the_catalogue_has_the_limits_of_its_standard():
    (chain,) = (family for family in gear_catalogue() if family.kind is GearKind.CHAIN_SLING)
    limits = {size.name: size.wll_kg for size in chain.sizes}
    assert (limits["8 mm"], limits["13 mm"], limits["32 mm"]) == (2000.0, 5300.0, 31_500.0)  # EN 818-4
    assert [limits[f"{mm} mm"] for mm in (36, 40, 45)] == [40_000.0, 50_000.0, 63_000.0]
    for name, limit_kg in limits.items():  # EN 818-2: 200 N/mm2 in both sides of a link, rounded down
        at_stress_kg = math.pi / 2.0 * float(name.removesuffix(" mm")) ** 2 * 200.0 / 9.81
        assert 0.94 * at_stress_kg < limit_kg <= at_stress_kg, name
    assert all(size.mass_kg > 0.0 and size.leg_kg > 0.0 and size.kg_per_m > 0.0 for size in chain.sizes)


def test_own_gear_is_a_file_like_those_of_the_catalogue():
    family = GEAR_FILES.read(OWN.encode(), Path("own.toml"))
    assert (family.name, family.lengths_m, [size.name for size in family.sizes]) == (
        "our chains",
        (3.0, 5.0),
        ["10 mm", "16 mm"],
    )


@pytest.mark.parametrize(
    ("old", "new", "key", "says"),
    [
        ("[3, 5]", "[5, 3]", None, "lengths_m must ascend"),
        ("lengths_m = [3, 5]", "", None, "lengths_m is missing"),
        ("wll_kg = 8000", "wll_kg = 800", None, "the weakest comes first"),
        ('"16 mm"', '"10 mm"', None, "two sizes have the same name"),
        ("wll_kg = 3150, ", "", None, r"size\[0\].wll_kg is missing"),
        ('"chain_sling"', '"rope"', "kind", "rope"),
        ("lengths_m = [3, 5]", "lengths_m = [3, 5]\nchoked = 0.8", None, "choked is not for"),
        ("wll_kg = 3150, ", "wll_kg = -3, ", "size[0].wll_kg", "greater than 0"),
        ('"chain_sling"', '"spreader"', None, r"size\[0\].chart is missing"),
        ("kg_per_m = 2.2", "kg_per_metre = 2.2", "size[0].kg_per_metre", "unknown|not a key"),
    ],
)
def test_a_wrong_file_of_gear_is_refused_by_key(old, new, key, says):
    assert old in OWN
    with pytest.raises(ConfigError, match=says) as caught:
        GEAR_FILES.read(OWN.replace(old, new, 1).encode(), Path("own.toml"))
    assert key is None or caught.value.key == key
