"""``python -m benchmarks.freeze_suite``: whether the held-out suite is the frozen one; ``--write`` freezes it anew.

``--building`` also plans the sample building anew and freezes its lifts.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from benchmarks.train_generalist import TEST_MODELS, stages_of
from bimvox.policy.generalist.problems import HELD_OUT_DOMAIN
from bimvox.policy.generalist.stages import BuildingStage, building_lifts, save_stages
from bimvox.policy.generalist.suite import BUILDING, BUILDING_COUNT, FROZEN, digest_of, frozen_text


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
        save_stages(BUILDING, [BuildingStage(one.space, one.start_vox, one.target_vox, nowhere) for one in lifts])
    text = frozen_text()
    if chosen.write:
        FROZEN.write_text(text)
    same = text == FROZEN.read_text()
    sys.stdout.write(f"{FROZEN.name}: {'the same' if same else 'differs from the problems made now'}\n")
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
