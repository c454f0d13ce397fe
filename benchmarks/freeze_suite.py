"""``python -m benchmarks.freeze_suite``: whether the held-out suite is the frozen one; ``--write`` freezes it anew.

``--building`` also plans the sample building anew and freezes its lifts.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.train_generalist import TEST_MODELS, BuildingStage, building_lifts, stages_of
from bimvox.policy.generalist.problems import HELD_OUT_DOMAIN, occupancy_of
from bimvox.policy.generalist.suite import BUILDING, BUILDING_COUNT, FORMAT, FROZEN, digest_of, problem_sets, set_digest


def main() -> int:
    """Compare or write the frozen files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help=f"write {FROZEN.name} of the package")
    parser.add_argument("--building", action="store_true", help=f"write {BUILDING.name} of the package first")
    chosen = parser.parse_args()
    if chosen.building:
        drawn = building_lifts(stages_of(TEST_MODELS), count=2 * BUILDING_COUNT, domain=HELD_OUT_DOMAIN, starts=1)
        lifts = list({digest_of(one): one for one in drawn}.values())[:BUILDING_COUNT]
        nowhere = np.zeros((0, 3), np.int32)
        _save_stages(BUILDING, [BuildingStage(one.space, one.start_vox, one.target_vox, nowhere) for one in lifts])
    text = frozen_text()
    if chosen.write:
        FROZEN.write_text(text)
    same = text == FROZEN.read_text()
    sys.stdout.write(f"{FROZEN.name}: {'the same' if same else 'differs from the problems made now'}\n")
    return 0 if same else 1


def frozen_text() -> str:
    """Return the content of the frozen file, made anew from the generators and the building's file."""
    sets: dict[str, dict[str, Any]] = {}
    for one in problem_sets().values():
        digests = [digest_of(one.make(number)) for number in range(one.count)]
        sets[one.name] = {"seeds": [0, one.count - 1], "digest": set_digest(digests), "digests": digests}
    sets["building"] |= {"file": BUILDING.name, "sha256": hashlib.sha256(BUILDING.read_bytes()).hexdigest()}
    return json.dumps({"format": FORMAT, "version": 1, "sets": sets}, indent=1) + "\n"


def _save_stages(file: Path, stages: Sequence[BuildingStage]) -> None:
    """Write stages to a compressed NumPy archive: of every array those of all stages, flat, and their shapes."""
    each = [_arrays(stage) for stage in stages]
    arrays: dict[str, NDArray[np.generic]] = {}
    for key in each[0]:
        arrays[key] = np.concatenate([one[key].reshape(-1) for one in each])
        arrays[f"{key}.shape"] = np.array([one[key].shape for one in each], np.int32)
    with file.open("wb") as stream:
        np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]


def _arrays(stage: BuildingStage) -> dict[str, NDArray[np.generic]]:
    space = stage.space
    occupied = occupancy_of(space)
    return {
        "grid": np.array(occupied.shape, np.int32),
        "occupied": np.packbits(occupied),
        **{name: array for name, array in space._asdict().items() if name != "table"},
        "way": np.array([stage.start_vox, stage.gate_vox], np.int32),
        "yard": stage.yard_vox,
    }


if __name__ == "__main__":
    sys.exit(main())
