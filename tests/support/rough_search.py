"""A search for set-ups that times few lifts: for tests of what becomes of a choice, not of how good it is."""

from __future__ import annotations

import pytest

from bimvox.library.set_up_search.search import Search

_LIFTS = 4


def time_few_lifts(patched: pytest.MonkeyPatch) -> None:
    """Time a few lifts of each set-up, as long as the patch lasts."""
    timed_s = Search.timed_s
    patched.setattr(
        Search, "timed_s", lambda search, crane, served, _=None, yard=None: timed_s(search, crane, served, _LIFTS, yard)
    )
