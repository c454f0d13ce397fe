"""The planned frame."""

from __future__ import annotations

import pytest
from planned_frame import FILES, planned

from bimvox.library.site import load_site
from bimvox.log.reader import read_log
from bimvox.records.lift import Lift
from bimvox.site.site import Site


@pytest.fixture(scope="module")
def site() -> Site:
    return load_site(planned() / FILES[0]).site


@pytest.fixture(scope="module")
def lifts() -> tuple[Lift, ...]:
    return read_log(planned() / FILES[1]).plan.lifts
