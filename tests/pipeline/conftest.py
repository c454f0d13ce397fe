"""A small planned site, made once per test session: the sample frame at coarse cells, with a short training."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from bimvox_pipeline.plan import plan
from bimvox_pipeline.site import init

from bimvox.library.policy_wish import PolicyWish
from bimvox.policy import store as policies
from bimvox.progress import SilentProgress

SAMPLES = Path(__file__).parents[2] / "sample_models"
STEPS = 2_000


@pytest.fixture(scope="session")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Use a policy store that belongs to the tests."""
    folder = tmp_path_factory.mktemp("policies")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BIMVOX_POLICIES", str(folder))
        yield folder


@pytest.fixture(scope="session")
def planned(store: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    """Folder with model, site file and log, and the plan's document."""
    folder = tmp_path_factory.mktemp("frame")
    model = folder / "frame.ifc"
    shutil.copy(SAMPLES / "frame.ifc", model)
    init(model, folder / "frame.site.toml", voxel_size_m=0.5, crane="hammerhead-30", progress=SilentProgress())
    site = folder / "frame.site.toml"
    # Its longest jib, and 1 m more rope: the tests of stops look for loads that swing.
    text = site.read_text().replace("jib_length_m = 18", "jib_length_m = 30")
    site.write_text(text.replace("jib_height_m = 15", "jib_height_m = 16"))
    document = plan(
        folder / "frame.site.toml", folder / "frame.mcap", wish=PolicyWish(steps=STEPS), progress=SilentProgress()
    )
    return folder, document


@pytest.fixture
def site_folder(planned: tuple[Path, dict], store: Path, tmp_path: Path) -> Path:
    """Return a fresh copy of the planned folder that the test may change."""
    for source in planned[0].iterdir():
        shutil.copy(source, tmp_path / source.name)
    return tmp_path


@pytest.fixture
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty policy store for one test."""
    folder = tmp_path / "own-store"
    monkeypatch.setenv(policies.STORE_VARIABLE, str(folder))
    return folder
