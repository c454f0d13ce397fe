"""The frozen set ``Sequence-v0``: buildings, cranes and yards, each with the digest of all that decides it."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Protocol

from bimvox.errors import InputError
from bimvox.library.sequences.buildings import Precast
from bimvox.library.site import LoadedSite, built_site
from bimvox.planning.all_orders import least_makespan_s
from bimvox.progress import SilentProgress
from bimvox.site.config.file import SITE_FILE, parse_site_config
from bimvox.site.guess import complete_config

FROZEN = Path(__file__).with_name("suite.json")

_YARD_M, _FREE_M, _BEHIND_M = 6.0, 1.5, 3.0
_JIBS_M = (18, 24, 30)
_CELL_M = 0.2

_SITE = """\
name = "{name}"

[model]
path = "{name}"
voxel_size_m = {cell}
ground_m = 0.0

[areas]
construction = [[-1.0, -1.0], [{far_x}, -1.0], [{far_x}, {far_y}], [-1.0, {far_y}]]
yard = [[[-1.0, {yard_low}], [{far_x}, {yard_low}], [{far_x}, {yard_high}], [-1.0, {yard_high}]]]
"""

_CRANE = """
[[crane]]
name = "{name}"
machine = "hammerhead-30"
base_m = [{x}, {y}]
jib_height_m = {jib}
jib_length_m = {length}
"""


class SequenceProblem(Protocol):
    """A building and its cranes."""

    @property
    def name(self) -> str:
        """Its set and its number in it, as in ``halls-0``."""

    def site(self) -> LoadedSite:
        """Return its site."""


@dataclass(frozen=True, slots=True)
class GeneratedProblem:
    """A generated building, one or two cranes behind it, and a yard in front of it.

    Attributes:
        name: Its set and its number.
        building: The building.
        cranes: One or two.
    """

    name: str
    building: Precast
    cranes: int = 1

    def site_file(self) -> str:
        """Return its site file: the cranes behind the building, the yard in front of it along its whole length."""
        (*_, end_x), (*_, end_y) = self.building.lines_m
        high_m = 3.6 * self.building.storeys
        yard = {"yard_low": -_FREE_M - _YARD_M, "yard_high": -_FREE_M}
        text = _SITE.format(name=self.name, cell=_CELL_M, far_x=_m(end_x + 1.0), far_y=_m(end_y + 1.0), **yard)
        for n in range(self.cranes):
            at_x = end_x * (0.5 if self.cranes == 1 else (0.05, 0.95)[n])
            far_m = math.hypot(at_x, _BEHIND_M + end_y + _FREE_M + _YARD_M)
            text += _CRANE.format(
                name="crane" if self.cranes == 1 else ("west", "east")[n],
                x=_m(at_x),
                y=_m(end_y + _BEHIND_M),
                jib=_m(high_m + 14.0 + 4.0 * n),
                length=_JIBS_M[0]
                if self.cranes > 1
                else next(jib for jib in _JIBS_M if jib >= min(far_m, _JIBS_M[-1])),
            )
        return text

    def site(self) -> LoadedSite:
        """Return its site."""
        building, text = self.building.building(), self.site_file()
        config = complete_config(parse_site_config(text, f"{self.name}.site.toml"), building)
        return built_site(config, building, {SITE_FILE: text.encode()}, SilentProgress())


def _m(length_m: float) -> float:
    return round(length_m, 1)


def sequence_problems() -> dict[str, tuple[SequenceProblem, ...]]:
    """Return the generated problems of ``Sequence-v0`` by set.

    ``small``: one crane, few enough parts to try every order; ``storeys``: one crane; ``halls``: two cranes, and which
    of them lifts a part is part of the answer.
    """
    small = (Precast((2, 0), 1, 0, 1), Precast((1, 1), 1, 0, 2), Precast((1, 0), 2, 0, 3))
    storeys = (Precast((2, 1), 1, 3, 4), Precast((1, 1), 3, 2, 5), Precast((2, 2), 2, 3, 6))
    halls = (Precast((5, 1), 1, 0, 7), Precast((5, 1), 1, 3, 8), Precast((6, 1), 1, 0, 9))
    sets = {"small": (small, 1), "storeys": (storeys, 1), "halls": (halls, 2)}
    return {
        name: tuple(GeneratedProblem(f"{name}-{n}", building, cranes) for n, building in enumerate(buildings))
        for name, (buildings, cranes) in sets.items()
    }


def digest_of(site: LoadedSite) -> str:
    """Return the first 16 hexadecimal digits of the SHA-256 of all that decides a problem.

    That is its geometry with the cranes, its site file, what its parts weigh, and the least time, which changes with
    the crew's times and the cranes' rates.
    """
    least_s = least_makespan_s(site.site)
    sha = hashlib.sha256(f"{site.site.geometry_digest} {least_s:.1f}\n".encode() + site.files[SITE_FILE])
    for part in site.components:
        sha.update(f"{part.id} {part.ifc_class} {part.mass_kg:.3f} {part.crane}\n".encode())
    return sha.hexdigest()[:16]


@cache
def frozen_digests() -> Mapping[str, str]:
    """Return the digests of the frozen file by the names of problems."""
    document: dict[str, Any] = json.loads(FROZEN.read_text())
    return {str(name): str(digest) for name, digest in document["digests"].items()}


def frozen_site(problem: SequenceProblem) -> LoadedSite:
    """Return the site of a problem, after comparing it with its frozen digest.

    Raises:
        InputError: It is not the frozen one.
    """
    site = problem.site()
    found, frozen = digest_of(site), frozen_digests().get(problem.name)
    if found != frozen:
        raise InputError(
            f"{problem.name} is not the frozen problem: its digest is {found}, not {frozen}",
            hint="results of this version are not those of Sequence-v0: install the version that the table names",
        )
    return site
