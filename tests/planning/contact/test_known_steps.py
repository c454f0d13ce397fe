"""Steps between cells are tested once, and give what the test of each one alone gives."""

import numpy as np
import pytest
from box_sites import box_site

from bimvox.planning.contact import pairs
from bimvox.planning.contact.pairs import Contacts

PARTS = [
    ("part", (4.0, 4.0, 1.0), (6.0, 5.0, 1.5)),
    ("shelf", (5.5, 4.0, 1.52), (8.0, 5.0, 1.8)),
    ("post", (6.2, 4.0, 0.0), (6.6, 5.0, 3.0)),
    ("far", (2.5, 4.2, 0.03), (3.5, 4.8, 1.37)),
]


@pytest.fixture
def contacts(monkeypatch):
    made = Contacts(box_site(PARTS))
    sweeps, swept = [], pairs.blocked_steps
    monkeypatch.setattr(pairs, "blocked_steps", lambda *args: sweeps.append(args) or swept(*args))
    made.sweeps = sweeps
    return made


@pytest.mark.parametrize("is_near", [True, False])
@pytest.mark.parametrize("fixed", [1, 2, 3])
def test_a_step_is_blocked_as_its_own_test_says(contacts, fixed, is_near):
    test = contacts.meets_on_move if is_near else contacts.strikes_on_move
    offsets = [(x, y, z) for x in range(-5, 6) for y in (-1, 0) for z in (-2, 0, 1, 2)]
    blocked = set()
    for _ in range(2):
        for axis in range(3):
            for offset in offsets:
                found = contacts.steps.is_blocked(0, fixed, offset, axis, is_near=is_near)
                assert found == test(0, np.array(offset) * 0.5, fixed, axis, 1, 0.5, 1)[0], (axis, offset)
                blocked |= {(axis, offset)} if found else set()
    assert 3 < len(blocked) < 3 * len(offsets) - 3


def test_a_line_of_steps_is_swept_once_for_all_of_them(contacts):
    for offset in [(x, 0, 0) for x in range(8)] * 3:
        contacts.steps.is_blocked(0, 2, offset, 0, is_near=True)
    assert len(contacts.sweeps) == 1
    contacts.steps.is_blocked(0, 2, (8, 0, 0), 0, is_near=True)
    assert len(contacts.sweeps) == 2
