"""The checkpoint of a running training, from which an interrupted one resumes."""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
from pathlib import Path

from bimvox.errors import FileError, PolicyError
from bimvox.policy import store
from bimvox.policy.config import DqnConfig
from bimvox.policy.trained import TrainedPolicy


class Checkpoint:
    """The best policy of a running training, kept next to the policy store until the training ends.

    Its name is a hash of the arguments, so another training does not find it.

    Args:
        geometry_key: Digest of the site.
        config: The choices.
        seed: The seed.
        parent: Id of the initial policy. None if the training starts from scratch.
        budget: Environment steps.
    """

    def __init__(self, geometry_key: str, config: DqnConfig, seed: int, parent: str | None, budget: int) -> None:
        identity = json.dumps([geometry_key, config.to_dict(), seed, parent, budget], sort_keys=True)
        folder = store.store_folder()
        name = hashlib.sha256(identity.encode()).hexdigest()[:16]
        self._geometry_key = geometry_key
        self.folder = folder.with_name(f"{folder.name}-unfinished") / name

    def save(self, policy: TrainedPolicy) -> None:
        """Replace the checkpoint, completely or not at all."""
        parent = self.folder.parent
        try:
            parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(prefix=".writing-", dir=parent) as temporary:
                store.save(policy, self._geometry_key, folder=Path(temporary) / "new")
                old = Path(temporary) / "old"
                if self.folder.exists():
                    self.folder.rename(old)
                (Path(temporary) / "new").rename(self.folder)
        except OSError as error:
            raise FileError(self.folder, f"the checkpoint could not be written: {error}") from error

    def load(self) -> TrainedPolicy | None:
        """Return the checkpoint. None if there is none that this version can use."""
        names = sorted(place.name for place in self.folder.iterdir()) if self.folder.is_dir() else []
        if len(names) != 1:
            return None
        try:
            return store.load(names[0], folder=self.folder).trained
        except PolicyError:
            return None

    def remove(self) -> None:
        """Remove the checkpoint, at the end of the training."""
        shutil.rmtree(self.folder, ignore_errors=True)
