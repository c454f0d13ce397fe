"""The runs of a fleet: what each plans, what it is called, and the hash of everything that it is made from."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bimvox.files import default_output, sha256_of
from bimvox.version import __version__

MEANING = 1
"""Grows when the same inputs give other results."""


@dataclass(frozen=True, slots=True)
class Wish:
    """What a run is asked to do.

    Attributes:
        site: The site file.
        obstructions: What is in the way; None for the site as it is.
        seed: Seed of the training; None for the site file's.
        policy: Id of a policy, or ``none``; None: the site file's, otherwise the one trained for the site.
        steps: Training budget; None: the site file's, otherwise the built-in one.
    """

    site: Path
    obstructions: Path | None = None
    seed: int | None = None
    policy: str | None = None
    steps: int | None = None


@dataclass(frozen=True, slots=True)
class Run:
    """A wish with its name: that of its files in the fleet's folder.

    Attributes:
        name: The name, each once in a fleet.
        wish: What to do.
        leads: Whether it is the first of those that a policy is trained for, which the others then find in the store.
    """

    name: str
    wish: Wish
    leads: bool


def runs_of(wishes: Iterable[Wish]) -> tuple[Run, ...]:
    """Return runs, in the order of their wishes; the same wish twice is one run."""
    distinct = list(dict.fromkeys(replace(wish, site=wish.site.resolve()) for wish in wishes))
    names = [_name_of(wish) for wish in distinct]
    often = Counter(name.lower() for name in names)
    runs, trained = [], set()
    for wish, name in zip(distinct, names, strict=True):
        whole = name if often[name.lower()] == 1 else f"{name}-{_mark_of(wish)}"
        key = (wish.site, wish.seed, wish.policy, wish.steps)
        runs.append(Run(whole, wish, key not in trained))
        trained.add(key)
    return tuple(runs)


def digest_of(wish: Wish) -> str:
    """Return the hash of everything that a run's result depends on: contents, not names of folders.

    Raises:
        BimvoxError: If an input is missing, or so broken that it does not say what else it is made from.
    """
    from bimvox.files import require_input
    from bimvox.site.config_file import load_site_config

    require_input(wish.site)
    config = load_site_config(wish.site)
    files = [wish.site, config.model.path]
    if wish.obstructions is not None:
        files += [require_input(wish.obstructions), *_referred(wish.obstructions)]
    plain: dict[str, Any] = {
        "meaning": MEANING,
        "bimvox": __version__,
        "files": [[file.name, sha256_of(file)] for file in files],
        "seed": wish.seed,
        "policy": wish.policy,
        "steps": wish.steps,
    }
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()


def _referred(obstructions: Path) -> Sequence[Path]:
    """Mesh and point files that an obstruction file names."""
    from bimvox.bim.read import IFC_SUFFIXES, MESH_SUFFIXES
    from bimvox.site.obstructions.file import parse_obstructions

    if obstructions.suffix.lower() in IFC_SUFFIXES + MESH_SUFFIXES:
        return ()
    return parse_obstructions(obstructions.read_bytes(), obstructions.name, obstructions.resolve().parent).files


def _name_of(wish: Wish) -> str:
    parts = [default_output(wish.site, "").name]
    if wish.obstructions is not None:
        parts.append(wish.obstructions.stem)
    if wish.seed is not None:
        parts.append(f"seed{wish.seed}")
    return "-".join(parts)


def _mark_of(wish: Wish) -> str:
    """Tell runs apart that would be called the same: files of one name in several folders, other policies."""
    plain = [str(wish.site), str(wish.obstructions), str(wish.seed), str(wish.policy), str(wish.steps)]
    return hashlib.sha256("\0".join(plain).encode()).hexdigest()[:8]
