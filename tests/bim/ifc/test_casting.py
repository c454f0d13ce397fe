"""Whether a part is precast or cast in place, as properties and words state it."""

from __future__ import annotations

import pytest

from bimvox.bim.building import Casting
from bimvox.bim.ifc.casting import casting_by_words, stated_casting


@pytest.mark.parametrize(
    ("text", "casting"),
    [
        ("Concrete - Cast-in-Place Concrete", Casting.IN_SITU),
        ("Cast in situ", Casting.IN_SITU),
        ("Ortbeton C25/30", Casting.IN_SITU),
        ("Béton coulé en place", Casting.IN_SITU),
        ("Concrete - Precast Concrete", Casting.PRECAST),
        ("Kanaalplaat 200", Casting.PRECAST),
        ("Steel S235, cast iron", None),
        ("Insitute wall", None),
    ],
)
def test_words_of_material_type_or_name(text: str, casting: Casting | None) -> None:
    assert casting_by_words([None, text, ""]) is casting


def test_precast_wins_over_a_topping_cast_on_it() -> None:
    assert casting_by_words(["Precast plank", "poured topping"]) is Casting.PRECAST


@pytest.mark.parametrize(
    ("sets", "casting"),
    [
        ({"Pset_ConcreteElementGeneral": {"CastingMethod": "INSITU"}}, Casting.IN_SITU),
        ({"Pset_ConcreteElementGeneral": {"CastingMethod": "PRECAST"}}, Casting.PRECAST),
        ({"Pset_ConcreteElementGeneral": {"CastingMethod": "MIXED"}}, None),
        ({"Pset_ConcreteElementGeneral": {"ConstructionMethod": "In-Situ"}}, Casting.IN_SITU),
        ({"Tekla Common": {"Cast_unit type": "CAST IN PLACE"}}, Casting.IN_SITU),
        ({"Pset_PrecastConcreteElementFabrication": {}}, Casting.PRECAST),
        ({"Pset_SlabCommon": {"Reference": "cast in place"}}, None),
    ],
)
def test_properties_that_state_it(sets: dict[str, dict[str, str]], casting: Casting | None) -> None:
    assert stated_casting(sets) is casting
