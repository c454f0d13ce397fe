import os

# One worker of the tests a core: further threads of a library would only wait for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import gc
from collections.abc import Iterator

import pytest
from hypothesis import settings
from warm_worker import start_warm

# Time limits are not tests: compilation or a busy machine would make them fail at random.
settings.register_profile("bimvox", deadline=None)
settings.load_profile("bimvox")


def pytest_collection_finish() -> None:
    """Collect garbage rarely, and leave what is loaded by now out of it: a process of the tests holds a lot."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 10)


@pytest.fixture(scope="session", autouse=True)
def warm_workers() -> Iterator[None]:
    """Fork the geometry processes from one that has their libraries."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bimvox.bim.ifc.geometry.start_connected", start_warm)
        yield
