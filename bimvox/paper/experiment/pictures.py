"""The pictures of an experiment: success curves as in the paper's Figure 5, policies as in Figure 4, the ablation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

from bimvox.paper.experiment.names import SCENARIOS, TITLES, mode_name

if TYPE_CHECKING:
    from bimvox.paper.experiment.results import ExperimentResults, ScenarioRun
    from bimvox.rendering.pictures.plots import Curve
    from bimvox.rendering.pictures.scene import Scene

_BY_THE_LOADED_POLICY = "no retraining in any seed:\nthe loaded policy gets by"


def pictures_of(results: ExperimentResults, document: dict[str, Any]) -> dict[str, bytes]:
    """Return the pictures of an experiment as PNG files by name; parts that were not run have none.

    ``document`` is ``document_of`` the results.
    """
    pictures = {"curves.png": success_curves(document["modes"])}
    if document["ablation"]:
        pictures["ablation.png"] = _ablation(document)
    for mode in document["modes"]:
        scenes = _policies([run for run in results.scenarios if run.mode == mode])
        if scenes:
            from bimvox.paper.rendering.path import draw_sheet
            from bimvox.rendering.pictures.picture import png_from_pixels

            pictures[f"policies-{mode}.png"] = png_from_pixels(draw_sheet(scenes))
    return pictures


def success_curves(modes: dict[str, Any], file_format: Literal["png", "svg"] = "png") -> bytes:
    """Return the success curves of the modes of a document, one panel per scenario, as a PNG or SVG file."""
    from bimvox.rendering.pictures.plots import Panel, draw_success_curves

    panels = []
    for scenario in SCENARIOS:
        drawn = [
            _curve(mode_name(mode), content["scenarios"][scenario]["curve"])
            for mode, content in modes.items()
            if content["scenarios"][scenario]["curve"]
        ]
        panels.append(Panel(TITLES[scenario], tuple(drawn), "" if drawn else _BY_THE_LOADED_POLICY))
    return draw_success_curves(panels, file_format=file_format)


def _curve(label: str, rows: Sequence[Sequence[float]]) -> Curve:
    """Return the curve of ``[steps, mean, low, high]`` rows."""
    import numpy as np

    from bimvox.rendering.pictures.plots import Curve

    steps, mean, low, high = np.array(rows, np.float64).T
    return Curve(label, steps, mean, low, high)


def _ablation(document: dict[str, Any]) -> bytes:
    from bimvox.rendering.pictures.plots import Bar, draw_bars

    bars = []
    for cell in document["ablation"]:
        median = cell["steps_to_success"]
        low, high = (cell["budget"] if value is None else value for value in cell["quartiles"])
        value = cell["budget"] if median is None else median
        group, series = cell["observation"], f"{cell['reward']} reward"
        bars.append(Bar(group, series, value, low, high, censored=median is None))
    return draw_bars(bars, axis="steps to 100 % (median, quartiles)", title="the paper's learner, by observation")


def _policies(runs: Sequence[ScenarioRun]) -> list[Scene]:
    """Return the four scenarios of the first seed that has all of them."""
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
        outcome = f"{how}, {moves} moves of at least {run.shortest_moves}" if moves > 0 else "not learned in the budget"
        scenes.append(
            scene_of_paths(
                site.picture(),
                before_vox=run.planned_cells,
                after_vox=run.path_cells,
                title=TITLES[scenario],
                caption=f"seed {run.seed}: {outcome}",
            )
        )
    return scenes
