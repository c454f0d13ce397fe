from dataclasses import replace

import fcl
import numpy as np
import pytest
from box_sites import box_site

from bimvox.bim.building import TriangleMesh
from bimvox.planning.contact.pairs import Contacts, collision_object
from bimvox.proof.bodies.overlap import overlaps_m
from bimvox.proof.bodies.solid import solid_of


def test_parts_that_share_or_touch_cells_are_neighbours():
    site = box_site(
        [
            ("left", (1.0, 1.0, 0.0), (2.1, 2.0, 1.0)),
            ("right", (2.1, 1.0, 0.0), (3.0, 2.0, 1.0)),
            ("far", (6.0, 1.0, 0.0), (7.0, 2.0, 1.0)),
            ("corner", (3.0, 2.0, 1.0), (4.0, 3.0, 2.0)),
        ],
        structure=[("pad", (6.0, 1.0, 1.0), (7.0, 2.0, 1.2))],
    )
    contacts = Contacts(site)
    assert contacts.neighbours == ((1,), (0, 3), (4,), (1,))
    assert not contacts.clashes


def test_parts_drawn_into_each_other_are_listed_with_their_depth():
    site = box_site(
        [
            ("a", (1.0, 1.0, 0.0), (2.0, 2.0, 1.0)),
            ("b", (1.95, 1.0, 0.0), (3.0, 2.0, 1.0)),
            ("c", (2.995, 1, 0), (4, 2, 1)),
        ]
    )
    contacts = Contacts(site)
    (clash,) = contacts.clashes  # b and c overlap by 5 mm, which is within the tolerance
    assert (clash.first, clash.second) == ("a", "b")
    assert clash.depth_m == pytest.approx(0.05, abs=0.0015)
    assert contacts.way_out_m(0, 1) == pytest.approx([-0.05, 0, 0], abs=0.0015)
    assert contacts.way_out_m(1, 0) == pytest.approx([0.05, 0, 0], abs=0.0015)
    assert contacts.way_out_m(1, 2) == pytest.approx([0, 0, 0])


@pytest.mark.parametrize("deep_m", [0.012, 0.03, 0.06])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_depth_of_whole_millimetres_is_found_wherever_the_parts_are(axis, deep_m):
    """Also where rounded coordinates overlap by a little less, and a longer way leads out to the side."""
    for face_m in (1.1, 2.3, 2.9, 3.1, 3.5):
        post, slab = np.array([(1.0, 1.0, 0.0), (1.3, 1.4, 0.0)]), np.array([(0.5004, 0.5004, 0.0), (4.0, 4.0, 0.0)])
        post[:, 2], slab[:, 2] = (face_m - 1.0, face_m + deep_m), (face_m, face_m + 0.5)
        post, slab = np.roll(post, axis, axis=1), np.roll(slab, axis, axis=1)
        site = box_site([("post", *post.tolist()), ("slab", *slab.tolist())])
        (clash,) = Contacts(site).clashes
        assert clash.depth_m == pytest.approx(deep_m, abs=0.0015), face_m


def test_a_part_drawn_right_through_another_has_no_short_way_out():
    site = box_site([("wall", (1.0, 1.0, 0.0), (6.0, 1.2, 3.0)), ("cross", (3.0, -3.0, 0.0), (3.2, 4.0, 3.0))])
    contacts = Contacts(site)
    assert [(c.first, c.second, c.way_out_m) for c in contacts.clashes] == [("wall", "cross", None)]
    assert contacts.way_out_m(0, 1) is None
    assert contacts.way_out_m(1, 0) is None


def test_parts_that_only_their_boxes_take_apart_have_a_way_out():
    """A wall that ends flush with the slab it goes through: the last step down still touches."""
    site = box_site([("wall", (3.0, 1.0, 0.0), (3.2, 9.0, 4.0)), ("slab", (1.0, 1.0, 3.85), (9.0, 9.0, 4.0))])
    contacts = Contacts(site)
    (clash,) = contacts.clashes
    assert clash.depth_m == pytest.approx(0.15, abs=0.002)
    assert contacts.way_out_m(0, 1) == pytest.approx([0.0, 0.0, -0.15], abs=0.002)


def test_moves_meet_only_beyond_the_tolerance():
    site = box_site([("a", (1.0, 1.0, 0.0), (2.0, 2.0, 1.0)), ("b", (2.0, 1.0, 0.0), (3.0, 2.0, 1.0))])
    contacts = Contacts(site)
    assert not contacts.meets_on_move(0, np.zeros(3), 1, 2, 1, 0.5, 4).any()
    assert contacts.meets_on_move(0, np.zeros(3), 1, 0, 1, 0.5, 4).any()
    assert not contacts.meets_on_move(0, np.array([0.009, 0, 0]), 1, 2, 1, 0.5, 4).any()
    assert contacts.meets_on_move(0, np.array([0.011, 0, 0]), 1, 2, 1, 0.5, 4).any()


@pytest.mark.parametrize(
    ("deep_m", "straight", "guided"), [(0.001, False, False), (0.002, False, True), (0.0029, True, True)]
)
def test_a_guided_sheet_may_use_up_the_skin_of_one_sheet_only(deep_m, straight, guided):
    """As in the proof: gutters of sheet steel were guided into each other, and refused."""
    site = box_site([("a", (1.0, 1.0, 0.0), (1.003, 3.0, 2.0)), ("b", (1.003, 1.5, 0.5), (1.006, 2.5, 1.5))])
    contacts, into_m = Contacts(site), np.array([deep_m, 0.0, 0.0])

    def meets(first_m, second_m, offset_m):
        return bool(fcl.collide(collision_object(first_m + offset_m), collision_object(second_m)))

    assert meets(*contacts.pair_m(0, 1), into_m) == straight
    assert meets(*contacts.guided_pair_m(0, 1), into_m) == guided
    assert meets(*contacts.guided_pair_m(1, 0), -into_m) == guided
    thick, thin = (solid_of(component.mesh, site.rules.contact_tolerance_m) for component in site.components)
    proven_m = overlaps_m(thick, thin, -into_m[None])
    assert np.isnan(proven_m[0, 0]) == (not guided)


def test_a_part_drawn_inside_another_is_listed_and_may_leave_as_deep_as_it_is_drawn():
    """Their surfaces do not cross: an anchor in a wall, 50 mm under its top."""
    site = box_site([("wall", (1.0, 1.0, 0.0), (4.0, 1.4, 3.0)), ("anchor", (2.0, 1.19, 2.9), (2.02, 1.21, 2.95))])
    contacts = Contacts(site)
    (clash,) = contacts.clashes
    assert (clash.first, clash.second) == ("wall", "anchor")
    assert clash.depth_m == pytest.approx(0.1, abs=0.0015)  # from its underside to the wall's top
    assert contacts.way_out_m(1, 0) == pytest.approx([0.0, 0.0, 0.1], abs=0.0015)
    assert not contacts.meets_on_move(1, np.zeros(3), 0, 2, 1, 0.5, 4).any()
    assert contacts.meets_on_move(1, np.zeros(3), 0, 2, -1, 0.5, 4).any()


def test_parts_in_the_hollow_of_another_are_not_drawn_into_it():
    """What lies between the legs of a channel is outside, although its box holds it."""
    site = box_site([("a", (1.0, 1.0, 0.0), (4.0, 1.4, 3.0)), ("b", (2.0, 1.5, 1.0), (2.2, 1.6, 1.2))])
    legs = [box_site([("leg", low, high)]).components[0].mesh for low, high in _LEGS]
    faces = np.concatenate([mesh.faces + 8 * n for n, mesh in enumerate(legs)]).astype(np.int32)
    channel = TriangleMesh(np.concatenate([mesh.vertices_m for mesh in legs]), faces)
    first, second = site.components
    site = replace(site, components=(replace(first, mesh=channel), second))
    assert not Contacts(site).clashes


_LEGS = (((1.0, 1.0, 0.0), (4.0, 1.4, 3.0)), ((1.0, 1.7, 0.0), (4.0, 2.1, 3.0)))
