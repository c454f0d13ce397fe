"""The lower bound of a motion's time."""

import pytest
from guided_sites import slab_between_beams
from planned_sites import planned

from bimvox.motion import timing


@pytest.mark.parametrize(("found_s", "share"), [(1e6, 1.0), (1.0, None)])
def test_a_bound_is_never_longer_than_the_motion(found_s, share, monkeypatch):
    """Moves that are shaped together may be quicker than the bound of moves that are shaped one by one."""
    monkeypatch.setattr(timing, "point_to_point_s", lambda *args: found_s)
    _, motions = planned(slab_between_beams())
    loaded = motions[0].loaded
    assert loaded.bound_s == pytest.approx(found_s if share is None else share * loaded.duration_s, rel=1e-6)
