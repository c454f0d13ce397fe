"""The pictures of an experiment: success curves as in the paper's Figure 5, policies as in Figure 4, the ablation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from bimvox.paper.env.picture import SitePicture
from bimvox.paper.experiment.jobs import SCENARIOS, TITLES, mode_name
from bimvox.paper.rendering import paper_site_scene
from bimvox.rendering.colours import FAINT_INK, PAPER, PATH
from bimvox.rendering.pictures.picture import PictureOptions, picture_of
from bimvox.rendering.pictures.scene import LegendEntry, Scene, Strokes, Swatch, polyline

if TYPE_CHECKING:
    from bimvox.paper.experiment.results import ExperimentResults, ScenarioRun
    from bimvox.rendering.pictures.plots import Curve
    from bimvox.rendering.pictures.scene import Scene


_CENTRE = 0.5
_LIFT = 0.06
"""The path before is drawn a little higher than the path after, so that both are visible where they agree."""


def _scene_of_paths(
    picture: SitePicture,
    *,
    before_vox: Sequence[tuple[int, int, int]],
    after_vox: Sequence[tuple[int, int, int]],
    title: str,
    caption: str,
) -> Scene:
    """Return the scene of a site with the planned path and the final path.

    ``picture``: the site before the first move; ``before_vox``: reference cells of the path of the basic policy;
    ``after_vox``: reference cells of the path of the policy after the change; empty if there is none.
    """
    scene = paper_site_scene(picture)
    strokes = list(scene.strokes)
    legend = list(scene.legend)
    if len(before_vox) > 1:
        points = np.array(before_vox, np.float64) + np.array([_CENTRE, _CENTRE, _CENTRE + _LIFT])
        strokes.append(Strokes(polyline(points), FAINT_INK, width_px=2.0, hidden_opacity=0.5, edge=PAPER))
        legend.append(LegendEntry("path before", FAINT_INK, Swatch.LINE))
    if len(after_vox) > 1:
        points = np.array(after_vox, np.float64) + _CENTRE
        strokes.append(Strokes(polyline(points), PATH, width_px=4.0, hidden_opacity=0.6, edge=PAPER))
        legend.append(LegendEntry("path after", PATH, Swatch.LINE))
    return replace(scene, strokes=tuple(strokes), legend=tuple(legend), title=title, caption=caption)


def _draw_sheet(
    scenes: Sequence[Scene], *, columns: int = 2, size_px: tuple[int, int] = (640, 480)
) -> NDArray[np.uint8]:
    """Return pictures in rows, (height, width, 3) uint8 sRGB; the last row is filled with background."""
    pictures = [picture_of(scene, PictureOptions(size_px=size_px)) for scene in scenes]
    blank = np.broadcast_to(np.array(PAPER, np.uint8), (size_px[1], size_px[0], 3))
    pictures += [blank] * (-len(pictures) % columns)
    rows = [np.concatenate(pictures[n : n + columns], axis=1) for n in range(0, len(pictures), columns)]
    return np.concatenate(rows, axis=0)


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
            from bimvox.rendering.pictures.picture import png_from_pixels

            pictures[f"policies-{mode}.png"] = png_from_pixels(_draw_sheet(scenes))
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
    from bimvox.paper.env.layout import PaperLayout
    from bimvox.paper.env.site_env import PaperSiteEnv
    from bimvox.paper.env.spec import YardPose

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
        layout = PaperLayout((YardPose(*run.start),), (run.target,), run.obstructions)
        site.reset(options={"layout": layout})
        how = "retrained" if run.retrained else "loaded policy"
        learned = f"{how}, {run.moves} moves of at least {run.shortest_moves}"
        outcome = learned if run.moves else "not learned in the budget"
        scenes.append(
            _scene_of_paths(
                site.picture(),
                before_vox=run.planned_cells,
                after_vox=run.path_cells,
                title=TITLES[scenario],
                caption=f"seed {run.seed}: {outcome}",
            )
        )
    return scenes
