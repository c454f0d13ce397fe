"""What the site file says of the bodies of a mesh."""

from __future__ import annotations

import dataclasses

import pytest
from box_buildings import box_element

from bimvox.bim.building import Role
from bimvox.bim.kinds.kind import Correction, Kind
from bimvox.bim.mesh.file import corrections_of, with_correction
from bimvox.errors import SelectionError

NAMES = ["wall-1", "wall-2", "door"]


def says(select, kind=None, means=None, *, one_part=False):
    return Correction(select, kind, means, "a.toml: model.kinds[0]", one_part)


def test_bodies_are_selected_by_names_and_patterns():
    found, lost = corrections_of("m.obj", NAMES, [says("wall*", Kind.TIMBER), says("wall-2", means="out")])
    assert {name: (one.kind, one.means) for name, one in found.items()} == {
        "wall-1": (Kind.TIMBER, None),
        "wall-2": (Kind.TIMBER, "out"),
    }
    assert not lost


def test_a_body_has_the_mass_of_its_kind():
    body = box_element("wall-1", (0, 0, 0), (1, 1, 1), ifc_class="Mesh")
    found, _ = corrections_of("m.obj", NAMES, [says("wall-1", Kind.STEEL), says("door", means="out")])
    assert with_correction(body, 1.0, found["wall-1"]).mass_kg == 7850.0
    assert with_correction(body, 1.0, found["door"]).role is Role.FITTING
    again = with_correction(
        dataclasses.replace(body, role=Role.GROUND), 1.0, corrections_of("", ["a"], [says("a", means="built")])[0]["a"]
    )
    assert (again.role, again.stated_means) == (Role.COMPONENT, "built")


def test_what_names_no_body_is_a_note():
    assert corrections_of("m.obj", NAMES, [says("roof*", Kind.TIMBER)])[1] == [
        "a.toml: model.kinds[0]: roof* selects no part of the model, so it changes nothing"
    ]
    with pytest.raises(SelectionError, match=r"a\.toml: model\.kinds\[0\]: select ' , ': names nothing"):
        corrections_of("m.obj", NAMES, [says(" , ", Kind.TIMBER)])
