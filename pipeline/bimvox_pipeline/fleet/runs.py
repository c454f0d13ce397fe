"""The runs of a fleet: what each plans, its name, and the hash of all its inputs."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from bimvox.errors import BimvoxError, ConfigError
from bimvox.files import default_output, sha256_of, write_atomically
from bimvox.site.config.file import read_site_file
from bimvox.site.config.validation import Table, Text, Whole, table_of
from bimvox.version import __version__

MEANING = 2
"""Incremented if the same inputs give different results."""


@dataclass(frozen=True, slots=True)
class Wish:
    """What a run plans.

    Attributes:
        site: The site file.
        obstructions: The obstruction file; None for the site without obstructions.
        seed: Seed of the training; None for the site file's.
        policy: Id of a policy, ``greedy`` or ``none``; None: the site file's, otherwise the one trained for the site,
            otherwise ``greedy``.
        steps: Training budget; None: the site file's, otherwise the built-in one.
        train: Whether a policy is trained for the site if there is none; a budget trains too.
    """

    site: Path
    obstructions: Path | None = None
    seed: int | None = None
    policy: str | None = None
    steps: int | None = None
    train: bool = False


@dataclass(frozen=True, slots=True)
class Run:
    """A wish with the name of its files in the fleet's folder.

    Attributes:
        name: The name, unique in a fleet.
        wish: What to plan.
        leads: Whether it is the first run of those that share a trained policy; the others find it in the store.
    """

    name: str
    wish: Wish
    leads: bool


def runs_of(wishes: Iterable[Wish]) -> tuple[Run, ...]:
    """Return runs, in the order of their wishes; equal wishes become one run."""
    distinct = list(dict.fromkeys(replace(wish, site=wish.site.resolve()) for wish in wishes))
    names = [_name_of(wish) for wish in distinct]
    often = Counter(name.lower() for name in names)
    runs, trained = [], set()
    for wish, name in zip(distinct, names, strict=True):
        whole = name if often[name.lower()] == 1 else f"{name}-{_mark_of(wish)}"
        key = (wish.site, wish.seed, wish.policy, wish.steps, wish.train)
        runs.append(Run(whole, wish, key not in trained))
        trained.add(key)
    return tuple(runs)


def digest_of(wish: Wish) -> str:
    """Return the hash of everything that a run's result depends on: file contents, not folder names.

    Raises:
        BimvoxError: If an input is missing, or too damaged to list its own inputs.
    """
    from bimvox.files import require_input
    from bimvox.site.config.file import load_site_config

    require_input(wish.site)
    config = load_site_config(wish.site)
    files = [wish.site, config.model.path, *(wish.site.parent / name for name in config.machine_files)]
    if config.sequence.programme is not None:
        files.append(wish.site.parent / config.sequence.programme)
    if wish.obstructions is not None:
        files += [require_input(wish.obstructions), *_referred(wish.obstructions)]
    plain: dict[str, Any] = {
        "meaning": MEANING,
        "bimvox": __version__,
        "files": [[file.name, sha256_of(file)] for file in files],
        "seed": wish.seed,
        "policy": wish.policy,
        "steps": wish.steps,
        "train": wish.train,
    }
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()


def _referred(obstructions: Path) -> Sequence[Path]:
    """Return the mesh and point files that an obstruction file names."""
    from bimvox.bim.read import IFC_SUFFIXES, MESH_SUFFIXES
    from bimvox.site.obstructions.file import read_obstruction_file

    if obstructions.suffix.lower() in IFC_SUFFIXES + MESH_SUFFIXES:
        return ()
    return read_obstruction_file(obstructions).files


def _name_of(wish: Wish) -> str:
    parts = [default_output(wish.site, "").name]
    if wish.obstructions is not None:
        parts.append(wish.obstructions.stem)
    if wish.seed is not None:
        parts.append(f"seed{wish.seed}")
    return "-".join(parts)


def _mark_of(wish: Wish) -> str:
    """Return a suffix that makes a run's name unique: files of several folders may have the same name."""
    plain = [str(wish.site), str(wish.obstructions), str(wish.seed), str(wish.policy), str(wish.steps), str(wish.train)]
    return hashlib.sha256("\0".join(plain).encode()).hexdigest()[:8]


# Executes one run and writes its outcome to disk, also if it is an error.

RECORDS = "runs"
"""Folder of the records inside the fleet's folder."""

PLANNED, _PARTLY, FAILED = "planned", "partly", "failed"
"""The outcome of a run: every lift planned, some infeasible, no plan."""


def record_file(folder: Path, name: str) -> Path:
    """Return the path of a run's record."""
    return folder / RECORDS / f"{name}.json"


def log_file(folder: Path, name: str) -> Path:
    """Return the path of a run's log."""
    return folder / f"{name}.mcap"


Work = Callable[[Run, Path], dict[str, Any]]
"""What a run does in a fleet's folder; returns its record. Workers import it: a function of a module."""


def carry_out(work: Work, run: Run, folder: Path) -> None:
    """Execute a run and write its record, also for an error."""
    try:
        record = work(run, folder)
    except BimvoxError as error:
        record = failed(run, error.code, error.message, error.hint)
    except Exception as error:  # noqa: BLE001  (a fault in one run must not take the others down; the record names it)
        record = failed(run, "fault", f"{type(error).__name__}: {error}".splitlines()[0], None)
    write_record(folder, record)


def write_record(folder: Path, record: dict[str, Any]) -> None:
    """Write a run's record atomically."""
    write_atomically(record_file(folder, record["run"]), json.dumps(record, indent=1, ensure_ascii=False).encode())


def failed(run: Run, code: str, message: str, hint: str | None) -> dict[str, Any]:
    """Return the record of a run without a plan."""
    return {**asked(run), "status": FAILED, "error": {"code": code, "message": message, "hint": hint}}


def planned(run: Run, folder: Path) -> dict[str, Any]:
    """Plan a run, write its log, and return its record."""
    from bimvox.library.arguments import PolicyWish
    from bimvox.progress import SilentProgress
    from bimvox_pipeline.plan import plan

    wish, log = run.wish, log_file(folder, run.name)
    digest = digest_of(wish)
    document = plan(
        wish.site,
        log,
        obstructions=wish.obstructions,
        wish=PolicyWish(wish.policy, wish.seed, wish.steps, wish.train),
        jobs=1,  # the runs share the processors
        progress=SilentProgress(),
    )
    return {
        **asked(run),
        "status": _PARTLY if document["infeasible"] else PLANNED,
        "error": None,
        "inputs": digest,
        "verified": document["verified"],
        "lifts": len(document["lifts"]),
        "infeasible": len(document["infeasible"]),
        "policy": document["policy"]["id"],
        "figures": document["figures"],
        "remarks": sum(remark["severity"] != "note" for remark in document["remarks"]),
        "serious_remarks": sum(remark["severity"] == "serious" for remark in document["remarks"]),
        "log": log.name,
        "log_sha256": sha256_of(log),
        "seconds": document["seconds"],
    }


def asked(run: Run) -> dict[str, Any]:
    """Return what the record of a run says about its wish."""
    wish = run.wish
    return {
        "run": run.name,
        "site": wish.site.name,
        "obstructions": wish.obstructions.name if wish.obstructions else None,
        "seed": wish.seed,
    }


# The sweep file: the sites, seeds and what-ifs to plan. ``bimvox schema sweep`` prints its schema.

_AS_IT_IS = "none"
"""The site without obstructions."""

_Seed = Annotated[Whole, Field(ge=0)]
_Steps = Annotated[Whole, Field(ge=1)]


class _RunEntry(Table):
    """One run, listed individually."""

    site: Text
    """Site file, relative to the sweep file's folder."""
    obstructions: Text = _AS_IT_IS
    """Obstruction, IFC or mesh file, or ``none``."""
    seed: _Seed | None = None
    """Seed of the training. Default: the site file's."""
    policy: Text | None = None
    """As for the sweep. Default: the sweep's."""
    steps: _Steps | None = None
    """As for the sweep. Default: the sweep's."""
    train: bool | None = None
    """As for the sweep. Default: the sweep's."""


class _SweepConfig(Table):
    """Every site with every seed and every obstruction file, and runs listed individually."""

    version: Literal[1] = 1
    """Version of this format."""
    sites: tuple[Text, ...] = ()
    """Site files or patterns, relative to the sweep file's folder."""
    seeds: tuple[_Seed, ...] = ()
    """Seeds of the training. Default: the site files'."""
    obstructions: tuple[Text, ...] = (_AS_IT_IS,)
    """Obstruction, IFC or mesh files, or patterns; ``none``: without obstructions."""
    policy: Text | None = None
    """Id of a policy, or ``none`` for search alone. Default: each site file's."""
    steps: _Steps | None = None
    """Trains, for at most that many environment steps. Default: each site file's."""
    train: bool = False
    """Whether a policy is trained for a site that has none; without it, seeds change nothing."""
    run: tuple[_RunEntry, ...] = ()
    """Further runs."""


def load_sweep(path: Path) -> tuple[Wish, ...]:
    """Return what a sweep file requests: the cross product, sites outermost, then the runs listed individually.

    Raises:
        ConfigError: If the file cannot be read, is not TOML, has an unknown key or an impossible value, a pattern
            matches no file, or no run is named.
    """
    config = table_of(read_site_file(path), path, _SweepConfig)
    wishes = [*_crossed(config, path), *_listed(config, path)]
    if not wishes:
        raise ConfigError(path, None, "names no runs", hint='name sites, as in sites = ["my.site.toml"]')
    return tuple(wishes)


def sweep_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the sweep file."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **_SweepConfig.model_json_schema()}


def _crossed(config: _SweepConfig, path: Path) -> Iterator[Wish]:
    sites = [file for n, name in enumerate(config.sites) for file in _files(name, path, f"sites[{n}]")]
    blocked: list[Path | None] = []
    for n, name in enumerate(config.obstructions):
        blocked += [None] if name == _AS_IT_IS else _files(name, path, f"obstructions[{n}]")
    seeds: tuple[int | None, ...] = config.seeds or (None,)
    for site, obstructions, seed in itertools.product(sites, blocked, seeds):
        yield Wish(site, obstructions, seed, config.policy, config.steps, config.train)


def _listed(config: _SweepConfig, path: Path) -> Iterator[Wish]:
    for entry in config.run:
        yield Wish(
            path.parent / entry.site,
            None if entry.obstructions == _AS_IT_IS else path.parent / entry.obstructions,
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
