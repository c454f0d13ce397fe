"""Executes a plan by a script with a manual clock: the watch of ``--simulate`` in this process.

Run in the folder of a planned site: ``python -m benchmarks.frozen.carried_out frame``. Prints the watch's output.
Only ``_watcher`` uses internals of the program.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.frozen.watched import OBSTRUCTIONS, Boxes, put

if TYPE_CHECKING:
    from bimvox_pipeline.watch.watch import Watcher

SPEED = 10.0
"""Speed of the site's clock relative to the wall clock."""


@dataclass(frozen=True, slots=True)
class Step:
    """A step of the script.

    Attributes:
        time_s: Its time on the site's clock.
        boxes: The contents of the obstruction file from then on.
    """

    time_s: float
    boxes: Boxes


SCRIPTS: dict[str, tuple[Step, ...]] = {
    "frame": (
        Step(1040.0, {"drone": (3.4, 3.1, 3.0, 3.8, 3.5, 3.6)}),
        Step(1200.0, {}),
        Step(1700.0, {"pallet": (0.1, 6.1, 3.0, 0.3, 6.3, 3.2)}),
        Step(1950.0, {}),
    ),
    "hall": (
        Step(1168.8, {"drone": (7.17, 3.42, 3.3, 7.27, 3.52, 3.4)}),
        Step(1250.0, {}),
        Step(1655.0, {"pallet": (12.05, 0.05, 0.0, 12.15, 0.15, 0.2)}),
        Step(1760.0, {}),
    ),
}
"""For each site: a load in transit stops at an obstruction and continues on another path. Later, a load is held on the
hook because its place is obstructed, and continues when the obstruction is removed."""


class Hand:
    """A wall clock that is set manually."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        """Return its time."""
        return self.now_s


def carry_out(name: str) -> Iterator[dict[str, Any]]:
    """Follow the script of a site in the current folder, and return the output of the watch."""
    hand, file = Hand(), Path(OBSTRUCTIONS)
    put(file, {})
    watcher, looks = _watcher(name, file, hand)
    try:
        yield from looks()
        for step in SCRIPTS[name]:
            hand.now_s = step.time_s / SPEED
            yield from looks()  # events up to this time, before the file changes
            put(file, step.boxes)
            yield from looks()
    finally:
        watcher.close()


def _watcher(name: str, file: Path, hand: Hand) -> tuple[Watcher, Callable[[], Iterator[dict[str, Any]]]]:
    """Return a watch that executes the plan on disk, and a function that checks the file once."""
    from bimvox_pipeline.watch.file_watch import state_of
    from bimvox_pipeline.watch.plan import WatchedPlan
    from bimvox_pipeline.watch.simulate import PlanClock
    from bimvox_pipeline.watch.watch import Watcher

    from bimvox.library.arguments import PolicyWish
    from bimvox.library.plan import policy_of
    from bimvox.library.prove import prepared
    from bimvox.library.site import load_site
    from bimvox.progress import SilentProgress

    quiet = SilentProgress()
    loaded = load_site(Path(f"{name}.site.toml"), quiet)
    _, preparation = prepared(loaded.site, quiet)
    policy = policy_of(loaded, loaded.site, preparation, PolicyWish("none"), quiet)
    clock = PlanClock(SPEED, hand)
    plan = WatchedPlan(loaded, policy, Path(f"{name}.mcap"), 0)
    watcher = Watcher(plan, preparation, file, quiet, clock)
    list(watcher.take_up(state_of(file)))
    watcher.begin()
    return watcher, lambda: watcher.change(replace(state_of(file), seen_s=hand.now_s))


def main() -> None:
    """Print the output of the watch of a site as a JSON list."""
    json.dump(list(carry_out(sys.argv[1])), sys.stdout)


if __name__ == "__main__":
    main()
