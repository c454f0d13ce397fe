"""The pictures of an experiment: success curves like the paper's Figure 5, policies like its Figure 4, the ablation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from bimvox_pipeline.paper.findings import SCENARIOS

if TYPE_CHECKING:
    from bimvox.rendering.plots.curves import Curve
    from bimvox.rendering.scene.scene import Scene
    from bimvox_pipeline.paper.results import ExperimentResults, ScenarioRun

TITLES = {
    "a": "(a) training environment, nothing changes",
    "b": "(b) one obstruction close to the start",
    "c": "(c) two obstructions side by side",
    "d": "(d) one obstruction close to the target",
}
MODE_NAMES = {"paper": "paper mode", "ours": "our mode"}
_BY_THE_LOADED_POLICY = "no retraining in any seed:\nthe loaded policy gets by"


def pictures_of(results: ExperimentResults, document: dict[str, Any]) -> dict[str, bytes]:
    """Return the pictures of an experiment as PNG files by name; what was not run has none.

    Args:
        results: Of the experiment.
        document: Of the same, as ``document_of`` gives it.
    """
    pictures = {"curves.png": _curves(document)}
    if document["ablation"]:
        pictures["ablation.png"] = _ablation(document)
    for mode in document["modes"]:
        scenes = _policies([run for run in results.scenarios if run.mode == mode])
        if scenes:
            from bimvox.paper.rendering.path import draw_sheet
            from bimvox.rendering.draw.png import png_from_pixels

            pictures[f"policies-{mode}.png"] = png_from_pixels(draw_sheet(scenes))
    return pictures


def _curves(document: dict[str, Any]) -> bytes:
    from bimvox.rendering.plots.curves import Panel, draw_success_curves

    panels = []
    for scenario in SCENARIOS:
        drawn = [
            curve_of(MODE_NAMES.get(mode, mode), content["scenarios"][scenario]["curve"])
            for mode, content in document["modes"].items()
            if content["scenarios"][scenario]["curve"]
        ]
        panels.append(Panel(TITLES[scenario], tuple(drawn), "" if drawn else _BY_THE_LOADED_POLICY))
    return draw_success_curves(panels)


def curve_of(label: str, rows: Sequence[Sequence[float]]) -> Curve:
    """Return the series of ``[steps, mean, low, high]`` rows."""
    import numpy as np

    from bimvox.rendering.plots.curves import Curve

    steps, mean, low, high = np.array(rows, np.float64).T
    return Curve(label, steps, mean, low, high)


def _ablation(document: dict[str, Any]) -> bytes:
    from bimvox.rendering.plots.bars import Bar, draw_bars

    bars = []
    for cell in document["ablation"]:
        median = cell["steps_to_success"]
        low, high = (cell["budget"] if value is None else value for value in cell["quartiles"])
        value = cell["budget"] if median is None else median
        group, series = cell["observation"], f"{cell['reward']} reward"
        bars.append(Bar(group, series, value, low, high, censored=median is None))
    return draw_bars(bars, axis="steps to 100 % (median, quartiles)", title="the paper's learner, by observation")


def _policies(runs: Sequence[ScenarioRun]) -> list[Scene]:
    """Return the four scenarios of the first seed that has them all."""
    from bimvox.paper.env.component import YardPose
    from bimvox.paper.env.layout import PaperLayout
    from bimvox.paper.env.site_env import PaperSiteEnv
    from bimvox.paper.rendering.path import scene_of_paths

    by_seed: dict[int, dict[str, ScenarioRun]] = {}
    for run in runs:
        by_seed.setdefault(run.seed, {})[run.scenario] = run
    whole = next((group for _, group in sorted(by_seed.items()) if set(group) == set(SCENARIOS)), None)
    if whole is None:
        return []
    site = PaperSiteEnv("paper")
    scenes = []
    for scenario in SCENARIOS:
        run = whole[scenario]
        layout = PaperLayout((YardPose(*run.start, run.axis),), (run.target,), run.obstructions)
        site.reset(options={"layout": layout})
        moves = len(run.path_cells) - 1
        how = "retrained" if run.retrained else "loaded policy"
        said = f"{how}, {moves} moves of at least {run.shortest_moves}" if moves > 0 else "not learned in the budget"
        scenes.append(
            scene_of_paths(
                site.picture(),
                before_vox=run.planned_cells,
                after_vox=run.path_cells,
                title=TITLES[scenario],
                caption=f"seed {run.seed}: {said}",
            )
        )
    return scenes
