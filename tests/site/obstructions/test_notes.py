from functools import partial

from bimvox.grid.frame import GridFrame
from bimvox.site.obstructions.cells import MOST_NAMED, Notes, Where, note_about


def test_a_note_names_the_obstruction_and_the_site():
    frame, shape = GridFrame((-1.0, 0.0, -0.1), 0.1), (20, 15, 12)
    outside = "obstruction 'x' lies outside the site, which is from (-1.00, 0.00, -0.10) to (1.00, 1.50, 1.10) m"
    assert note_about("x", Where.OUTSIDE, frame, shape) == outside
    assert note_about("x", Where.CLIPPED, frame, shape) == "obstruction 'x' is clipped to the site"


def test_very_many_notes_are_counted_but_for_those_of_other_files():
    notes = Notes()
    for n in range(MOST_NAMED + 1003):
        notes.add("outside the site" if n % 2 else "renamed", partial(str, n), always=n == 900)
    *named, more = notes.lines()
    assert named == [*(str(n) for n in range(MOST_NAMED)), "900"]
    assert more == "more obstructions: 502 outside the site, 500 renamed"


def test_few_notes_are_all_there():
    notes = Notes()
    assert notes.lines() == ()
    notes.add("renamed", lambda: "a", always=False)
    assert notes.lines() == ("a",)
