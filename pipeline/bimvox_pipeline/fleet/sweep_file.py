"""The sweep file: the sites, seeds and what-ifs to plan. ``bimvox schema sweep`` prints its schema."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from bimvox.errors import ConfigError
from bimvox.site.config.file import read_site_file
from bimvox.site.config.validation import Table, Text, Whole, table_of
from bimvox_pipeline.fleet.runs import Wish

AS_IT_IS = "none"
"""The site without obstructions."""

Seed = Annotated[Whole, Field(ge=0)]
Steps = Annotated[Whole, Field(ge=1)]


class RunEntry(Table):
    """One run, listed individually."""

    site: Text
    """Site file, relative to the sweep file's folder."""
    obstructions: Text = AS_IT_IS
    """Obstruction, IFC or mesh file, or ``none``."""
    seed: Seed | None = None
    """Seed of the training. Default: the site file's."""
    policy: Text | None = None
    """As for the sweep. Default: the sweep's."""
    steps: Steps | None = None
    """As for the sweep. Default: the sweep's."""
    train: bool | None = None
    """As for the sweep. Default: the sweep's."""


class SweepConfig(Table):
    """Every site with every seed and every obstruction file, and runs listed individually."""

    version: Literal[1] = 1
    """Version of this format."""
    sites: tuple[Text, ...] = ()
    """Site files or patterns, relative to the sweep file's folder."""
    seeds: tuple[Seed, ...] = ()
    """Seeds of the training. Default: the site files'."""
    obstructions: tuple[Text, ...] = (AS_IT_IS,)
    """Obstruction, IFC or mesh files, or patterns; ``none``: without obstructions."""
    policy: Text | None = None
    """Id of a policy, or ``none`` for search alone. Default: each site file's."""
    steps: Steps | None = None
    """Trains, for at most that many environment steps. Default: each site file's."""
    train: bool = False
    """Whether a policy is trained for a site that has none; without it, seeds change nothing."""
    run: tuple[RunEntry, ...] = ()
    """Further runs."""


def load_sweep(path: Path) -> tuple[Wish, ...]:
    """Read a sweep file.

    Args:
        path: A TOML file.

    Returns:
        What to plan: the cross product, sites outermost, then the runs listed individually.

    Raises:
        ConfigError: If the file cannot be read, is not TOML, has an unknown key or an impossible value, a pattern
            matches no file, or no run is named.
    """
    config = table_of(read_site_file(path), path, SweepConfig)
    wishes = [*_crossed(config, path), *_listed(config, path)]
    if not wishes:
        raise ConfigError(path, None, "names no runs", hint='name sites, as in sites = ["my.site.toml"]')
    return tuple(wishes)


def sweep_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the sweep file."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **SweepConfig.model_json_schema()}


def _crossed(config: SweepConfig, path: Path) -> Iterator[Wish]:
    sites = [file for n, name in enumerate(config.sites) for file in _files(name, path, f"sites[{n}]")]
    blocked: list[Path | None] = []
    for n, name in enumerate(config.obstructions):
        blocked += [None] if name == AS_IT_IS else _files(name, path, f"obstructions[{n}]")
    seeds: tuple[int | None, ...] = config.seeds or (None,)
    for site, obstructions, seed in itertools.product(sites, blocked, seeds):
        yield Wish(site, obstructions, seed, config.policy, config.steps, config.train)


def _listed(config: SweepConfig, path: Path) -> Iterator[Wish]:
    for entry in config.run:
        yield Wish(
            path.parent / entry.site,
            None if entry.obstructions == AS_IT_IS else path.parent / entry.obstructions,
            entry.seed,
            entry.policy or config.policy,
            entry.steps or config.steps,
            config.train if entry.train is None else entry.train,
        )


def _files(name: str, path: Path, key: str) -> list[Path]:
    """Return a named file, existing or not (its run reports that); for a pattern all matching files, sorted."""
    if not any(sign in name for sign in "*?["):
        return [path.parent / name]
    try:
        anchor = Path(name).anchor
        fitting = sorted((Path(anchor) if anchor else path.parent).glob(name.removeprefix(anchor)))
    except ValueError as error:
        raise ConfigError(path, key, f"{name!r} is not a pattern: {error}") from None
    if not fitting:
        raise ConfigError(path, key, f"no file matches {name!r}", hint="patterns start at the sweep file's folder")
    return fitting
