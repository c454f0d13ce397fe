"""``bimvox experiment sequence``: the score of an order on the frozen buildings of ``Sequence-v0``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bimvox.errors import InputError
from bimvox.library.sequences.baselines import BASELINES
from bimvox.library.sequences.score import score
from bimvox.library.sequences.suite import SequenceProblem, sequence_problems
from bimvox.library.site import LoadedSite, guess_site, read
from bimvox_pipeline.demo import SAMPLE, copy_sample
from bimvox_pipeline.named_code import named_order

if TYPE_CHECKING:
    from bimvox.progress import Progress


@dataclass(frozen=True, slots=True)
class SampleProblem:
    """The sample building of the package, with the crane and the yard that ``bimvox init`` guesses."""

    name: str = "samples-0"

    def site(self) -> LoadedSite:
        """Return its site."""
        with TemporaryDirectory(prefix="bimvox-sequence-") as folder:
            return guess_site(read(copy_sample(Path(folder)).with_name(SAMPLE)))


def all_problems() -> dict[str, tuple[SequenceProblem, ...]]:
    """Return the problems of ``Sequence-v0`` by set, the sample building too."""
    return {**sequence_problems(), "samples": (SampleProblem(),)}


def score_sequence(order: str, *, sets: Sequence[str] = (), progress: Progress) -> dict[str, Any]:
    """Score an order, and return the document of ``bimvox experiment sequence --json``.

    Args:
        order: A baseline (``trade``, ``greedy``, ``search``, ``exact``), or ``module:function``, whose code runs.
        sets: Names of sets; default: all.
        progress: Counts the buildings.

    Raises:
        InputError: There is no such order or set, or a building is not the frozen one.
    """
    known = all_problems()
    if unknown := [name for name in sets if name not in known]:
        raise InputError(f"--set {unknown[0]}: there is no such set", hint=f"one of {', '.join(known)}")
    problems = [problem for name in dict.fromkeys(sets or known) for problem in known[name]]
    if ":" not in order and order not in BASELINES:
        raise InputError(f"{order}: there is no such order", hint=f"one of {', '.join(BASELINES)}, or module:function")
    baseline = BASELINES.get(order)
    if baseline is None:
        given = named_order(order)
        if not callable(given):
            raise InputError(f"{order}: not a function", hint="give module:function; it gets the parts of a building")
        return score(order, lambda site: (site, given), problems, progress).model_dump(mode="json")
    return score(order, baseline, problems, progress).model_dump(mode="json")
