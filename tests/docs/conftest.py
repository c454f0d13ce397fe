from collections.abc import Iterator

import pytest


@pytest.fixture(scope="module", autouse=True)
def own_store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Use a policy store that belongs to the tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BIMVOX_POLICIES", str(tmp_path_factory.mktemp("policies")))
        yield
