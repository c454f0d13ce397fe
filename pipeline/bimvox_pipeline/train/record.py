"""What a training leaves while it runs: a checkpoint to resume from, and its curve for other tools."""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from bimvox.errors import FileError, PolicyError

if TYPE_CHECKING:
    from bimvox.policy.config import DqnConfig
    from bimvox.policy.trained import CurvePoint, TrainedPolicy


class Checkpoint:
    """The best policy of a running training, kept beside the policy store until the training ends.

    It belongs to one training: site, choices, seed, budget and the policy begun from; another finds nothing.

    Args:
        geometry_key: Digest of the site.
        config: The choices.
        seed: The seed.
        parent: Id of the policy begun from.
        budget: Environment steps.
    """

    def __init__(self, geometry_key: str, config: DqnConfig, seed: int, parent: str | None, budget: int) -> None:
        from bimvox.policy.store import store_folder

        identity = json.dumps([geometry_key, config.to_dict(), seed, parent, budget], sort_keys=True)
        store = store_folder()
        name = hashlib.sha256(identity.encode()).hexdigest()[:16]
        self._geometry_key = geometry_key
        self.folder = store.with_name(f"{store.name}-unfinished") / name

    def save(self, policy: TrainedPolicy) -> None:
        """Keep a policy instead of the one before; whole or not at all."""
        from bimvox.policy import store

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
        """Return what was kept, None where nothing is, or nothing that this version can use."""
        from bimvox.policy import store
        from bimvox.policy.trained import TrainedPolicy

        names = sorted(place.name for place in self.folder.iterdir()) if self.folder.is_dir() else []
        if len(names) != 1:
            return None
        try:
            found = store.load(names[0], folder=self.folder)
        except PolicyError:
            return None
        m = found.manifest
        return TrainedPolicy(
            found.network, m.curve, m.steps, m.success_rate, m.length_ratio, m.tested, m.config, m.seed, m.parent
        )

    def remove(self) -> None:
        """Forget it: the training has ended."""
        shutil.rmtree(self.folder, ignore_errors=True)


def write_curve(file: Path, curve: tuple[CurvePoint, ...]) -> None:
    """Write a curve as CSV: steps, success rate, mean path / shortest path."""
    from bimvox_pipeline.artifacts import write_atomically

    rows = [f"{p.steps},{p.success_rate:.6f},{p.length_ratio:.6f}" for p in curve]
    write_atomically(file, ("\n".join(["steps,success_rate,length_ratio", *rows]) + "\n").encode(), inputs=[])
