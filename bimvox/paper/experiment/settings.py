"""The settings of an experiment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bimvox.paper.policy.config import PaperDqnConfig

ABLATION_OBSERVATIONS = ("paper", "window", "egocentric")
ABLATION_REWARDS = ("paper", "shaped")
ALL_MODES = ("paper", "ours", "authors")


@dataclass(frozen=True, slots=True)
class PaperSettings:
    """Everything that the results depend on.

    Attributes:
        seeds: Each is one run of everything.
        modes: Configuration by name; all of ``ALL_MODES`` by default.
        matched_pairs: Pairs of obstructions that differ in the distance alone, per seed, in paper mode.
        matched_explorations: Shares of random actions with which retraining starts there.
        matched_test_every: Steps between two tests there.
        matched_budget: Steps of one retraining there.
        ablation_seeds: Number of seeds in the ablation.
        ablation_budget: Steps of one ablation run.
        targets_budget: Steps to solve ``targets_layouts`` layouts with drawn targets.
        targets_layouts: Number of those layouts.
        frame_budget: Steps to learn the frame of four columns and four beams.
        frame_layouts: Number of drawn yards from which the frame must be built.
        fresh_layouts: Number of layouts, unused by any test, that judge these two networks at the end.
        frame_changes: Fields of ``ours`` that the frame replaces.
        tabular_budget: Steps of tabular Q-learning in the initialization layer. For retraining it gets the networks'
            budget.
    """

    seeds: tuple[int, ...]
    modes: Mapping[str, PaperDqnConfig]
    matched_pairs: int = 3
    matched_explorations: tuple[float, ...] = (1.0, 0.02)
    matched_test_every: int = 250
    matched_budget: int = 20_000
    ablation_seeds: int = 10
    ablation_budget: int = 40_000
    targets_budget: int = 2_000
    targets_layouts: int = 1_000
    frame_budget: int = 50_000
    frame_layouts: int = 1_000
    fresh_layouts: int = 1_000
    frame_changes: Mapping[str, Any] = field(default_factory=dict)
    tabular_budget: int = 100_000

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            **{each.name: getattr(self, each.name) for each in fields(self)},
            "seeds": list(self.seeds),
            "matched_explorations": list(self.matched_explorations),
            "modes": {name: config.to_dict() for name, config in self.modes.items()},
            "frame_changes": dict(self.frame_changes),
        }


def default_settings(seeds: int = 10, modes: tuple[str, ...] = ALL_MODES) -> PaperSettings:
    """Return the settings of the whole experiment.

    Raises:
        ValueError: A mode is unknown, or there is no seed.
    """
    from bimvox.paper.policy.config import FRAME_CHANGES, MODES

    unknown = [name for name in modes if name not in MODES]
    if unknown:
        raise ValueError(f"modes: {', '.join(unknown)} unknown; there are {', '.join(MODES)}")
    if seeds < 1:
        raise ValueError(f"seeds: {seeds} is less than one")
    return PaperSettings(tuple(range(seeds)), {name: MODES[name] for name in modes}, frame_changes=FRAME_CHANGES)


def quick_settings(seeds: int = 2, modes: tuple[str, ...] = ALL_MODES) -> PaperSettings:
    """Return settings with tiny budgets, to check that everything runs; the results mean nothing."""
    full = default_settings(seeds, modes)
    tiny = {
        name: replace(config, budget=600, retrain_budget=400, test_every=200, learning_starts=100, test_episodes=10)
        for name, config in full.modes.items()
    }
    return replace(
        full,
        modes=tiny,
        matched_pairs=1,
        matched_test_every=100,
        matched_budget=200,
        ablation_seeds=1,
        ablation_budget=400,
        targets_budget=400,
        targets_layouts=20,
        frame_budget=400,
        frame_layouts=4,
        fresh_layouts=10,
        tabular_budget=2_000,
    )
