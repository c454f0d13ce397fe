import pytest
from box_sites import box_site, test_crane

from bimvox.errors import InputError
from bimvox.planning.contact import Contacts
from bimvox.planning.sequence import _one_way, assembly_order, precedence

PORTAL = [
    ("slab", (1.0, 1.0, 3.4), (5.0, 2.0, 3.6)),
    ("beam", (1.0, 1.4, 3.0), (5.0, 1.6, 3.4)),
    ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.98)),
    ("right", (4.8, 1.4, 0.0), (5.0, 1.6, 2.98)),
]


def order_of(site):
    contacts = Contacts(site)
    relations = precedence(site, contacts)
    return relations, assembly_order(site, relations)


def names(site, sequence):
    return [site.components[i].id for i in sequence.order]


def test_supports_stand_before_what_they_carry():
    site = box_site(PORTAL)
    relations, sequence = order_of(site)
    assert relations.supports[1] == (2, 3)  # across a joint of 20 mm
    assert relations.supports[0] == (1,)
    assert relations.grounded == (False, False, True, True)
    assert names(site, sequence) == ["left", "right", "beam", "slab"]
    assert not sequence.notes


def test_what_would_block_the_descent_comes_later():
    site = box_site(PORTAL)
    relations, _ = order_of(site)
    assert set(relations.descent[2]) == {0, 1}
    assert relations.descent[1] == (0,)
    assert relations.descent[0] == ()


def test_parts_side_by_side_do_not_order_each_other():
    relations, _ = order_of(box_site([("a", (1, 1, 0), (2, 2, 3)), ("b", (2, 1, 0), (3, 2, 1))]))
    assert relations.descent == ((), ())
    assert relations.supports == ((), ())


def test_the_planners_own_order_is_kept():
    site = box_site([("a", (1, 1, 0), (2, 2, 1)), ("b", (4, 1, 0), (5, 2, 1), {"before": ("a",)})])
    assert names(site, order_of(site)[1]) == ["b", "a"]


def test_a_constraint_on_an_unknown_component_is_an_error():
    site = box_site([("a", (1, 1, 0), (2, 2, 1), {"after": ("nobody",)})])
    with pytest.raises(InputError, match="nobody"):
        order_of(site)


def test_a_hung_panel_waits_for_what_it_touches_and_is_noted():
    site = box_site([("panel", (2.0, 1.0, 1.0), (2.2, 3.0, 2.0)), ("column", (1.0, 1.0, 0.0), (2.0, 2.0, 3.0))])
    _, sequence = order_of(site)
    assert names(site, sequence) == ["column", "panel"]
    assert sequence.notes == ("panel: nothing supports it within 0.05 m; it is set after a part that it touches",)


def test_a_circle_is_named_and_everything_is_still_ordered():
    site = box_site([("a", (1, 1, 0), (2, 2, 1), {"after": ("b",)}), ("b", (4, 1, 0), (5, 2, 1), {"after": ("a",)})])
    _, sequence = order_of(site)
    assert sorted(sequence.order) == [0, 1]
    assert any("circular" in note and "waited for b" in note for note in sequence.notes)


def test_structure_below_counts_as_support():
    site = box_site([("wall", (1, 1, 0.5), (4, 1.2, 3.0))], structure=[("footing", (1, 1, 0), (4, 2, 0.48))])
    relations, sequence = order_of(site)
    assert relations.grounded == (True,)
    assert not sequence.notes


def test_parts_that_rest_on_each_other_do_not_wait_for_each_other():
    """Two parts with a hook each, the one's over the other's and the other way round."""
    site = box_site([("a", (1, 1, 0), (2, 2, 1)), ("b", (4, 1, 0), (5, 2, 1))])
    assert _one_way([(1,), (0,)]) == ((), ())
    assert _one_way([(1,), (2,), (1, 3), ()]) == ((1,), (), (3,), ())
    assert order_of(site)[1].order == (0, 1)


def test_what_would_block_the_rope_comes_later():
    """A cap over the middle of a ring does not touch the ring's way down, but its rope's."""
    ring = ("frame", (1.0, 1.0, 0.0), (3.0, 3.0, 0.5))
    site = box_site([ring, ("cap", (1.8, 1.8, 3.0), (2.6, 2.6, 3.2))], crane=test_crane(base=(8.0, 8.0, 0.0)))
    assert order_of(site)[0].descent[0] == (1,)
