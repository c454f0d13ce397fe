"""Whether a part is precast or cast in place, as properties state it."""

from __future__ import annotations

import pytest

from bimvox.bim.building import Casting
from bimvox.bim.ifc.properties import stated_casting


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
