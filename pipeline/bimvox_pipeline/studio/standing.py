"""Whether the plan on disk is one of what a page shows: of exactly its set-up, and of exactly its obstructions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from bimvox.errors import BimvoxError, InputError
from bimvox.files import sha256_of
from bimvox.library.site import MACHINE, load_obstructions, rasterise, survey_in
from bimvox.log.plan_log import PlanLog, attached_programme, log_times
from bimvox.log.segments import first_plan_of
from bimvox.motion.figures import plan_figures
from bimvox.progress import SilentProgress
from bimvox.records.lift import infeasible_among
from bimvox.site.build import with_obstructions
from bimvox.site.config.file import SITE_FILE, parse_site_config
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.guess import complete_config
from bimvox.site.obstructions.obstruction_set import EMPTY
from bimvox.site.site import Blocker, Site, digest_of
from bimvox_pipeline.plan import figures_document
from bimvox_pipeline.studio.opened import Opened
from bimvox_pipeline.studio.setup import Setup
from bimvox_pipeline.watch.log import read_newest

_DIGITS = 3
"""Places are compared to the millimetre: a file in map coordinates gives them back to a tenth of it."""
_OBSTRUCTIONS = "the obstructions"
_MODEL = "the model"
_IN_WORDS = {
    "crane": "the crane",
    "areas": "the areas",
    "zone": "the zones",
    "rules": "the rules",
    "component": "how parts are set",
    "means": "how parts are set",
    "model": _MODEL,
}


def _state_of(config: SiteConfig, model_sha256: str, obstructions: Iterable[Blocker]) -> dict[str, str]:
    """Return the digests of all that a plan follows from, by what people call it.

    Args:
        config: The site file, complete.
        model_sha256: Hash of the model.
        obstructions: The obstructions on the site.
    """
    values = config.model_dump(mode="json", exclude={"name": True, "model": {"path"}})
    values["areas"] = _rounded(values["areas"])
    for zone in values["zone"]:
        zone["polygon"] = _rounded(zone["polygon"])
    cranes = values["crane"] if isinstance(values["crane"], list) else [values["crane"]]
    for crane in cranes:
        if crane is not None:
            crane["base_m"] = _rounded(crane["base_m"])
            for place in crane["setup"]:
                place["base_m"] = _rounded(place["base_m"])
    values["crane"] = cranes
    files = sorted(config.machine_files.items())
    made = {
        "model": digest_of(model_sha256, repr(values.pop("model"))),
        "crane": digest_of(repr(values.pop("crane")), files),
        "sequence": digest_of(repr(values.pop("sequence")), config.programme_file or b""),
        **{key: digest_of(repr(own)) for key, own in values.items()},
    }
    found: dict[str, str] = {}
    for key, digest in made.items():
        words = _IN_WORDS.get(key, f"[{key}] of the site file")
        found[words] = found.get(words, "") + digest
    cells = sorted((one.id, one.cells.tobytes()) for one in obstructions if one.kind == "obstruction")
    return {**found, _OBSTRUCTIONS: digest_of(cells)}


@dataclass(frozen=True, eq=False)
class PlanOnDisk:
    """The newest plan of a log and the revisions next to it.

    Attributes:
        record: The plan.
    """

    record: PlanLog

    @cached_property
    def version(self) -> str:
        """What differs between two plans: the plan with which it began, and the number of its revision."""
        return f"{first_plan_of(self.record)[:16]}-{self.record.revision}"

    @cached_property
    def _states(self) -> list[dict[str, str] | None]:
        return []

    @cached_property
    def _placed(self) -> dict[str, tuple[Blocker, ...]]:
        return {}

    @cached_property
    def document(self) -> dict[str, Any]:
        """Its figures, and what is refused in it, as JSON."""
        plan, motions = self.record.plan, self.record.motions
        figures = figures_document(plan_figures(plan, motions))
        wanted = ("crane_hours", "critical_lifts", "highest_utilisation")
        times = None if self.record.remarks is None else log_times(self.record)  # of values that make sense
        refused = [plan.site.components[lift.component].id for lift in infeasible_among(plan.lifts)]
        return {
            "version": self.version,
            "revision": self.record.revision,
            "figures": {key: figures[key] for key in wanted},
            "time": times.time if times else None,
            "planned": len(self.record.planned),
            "infeasible": refused,
        }

    def differences(self, opened: Opened, wanted: Setup, obstructions: Path) -> list[str]:
        """Return what differs between the plan and what a page shows, as words; nothing if it is a plan of that.

        Args:
            opened: The site that is open.
            wanted: The set-up on the screen.
            obstructions: The obstruction file.
        """
        if self.record.plan.site.source["sha256"] != opened.building.source.sha256:
            return [_MODEL]
        try:
            shown = _state_of(opened.with_setup(wanted), opened.building.source.sha256, self._there(obstructions))
        except InputError:
            return ["the set-up"]  # nothing can be planned with it
        if (planned := self._state(opened)) is None:
            return ["the site file"]
        return sorted(words for words in shown.keys() | planned.keys() if shown.get(words) != planned.get(words))

    def _state(self, opened: Opened) -> dict[str, str] | None:
        """Return the state of which it is a plan, from the files that it carries; None if they cannot be read."""
        if not self._states:
            given, model_sha256 = self.record.attachments, opened.building.source.sha256
            try:
                files = {name.removeprefix(MACHINE): data for name, data in given.items() if name.startswith(MACHINE)}
                text = given.get(SITE_FILE, b"").decode("utf-8-sig")
                config = parse_site_config(text, opened.site, files, attached_programme(self.record))
                config = complete_config(config, opened.building)
                self._states.append(_state_of(config, model_sha256, self.record.plan.site.blockers))
            except (BimvoxError, UnicodeDecodeError):
                self._states.append(None)
        return self._states[0]

    def _there(self, file: Path) -> tuple[Blocker, ...]:
        """Return the obstructions of a file on the plan's site.

        Raises:
            InputError: If it cannot be used.
        """
        site = self.record.plan.site
        if not file.exists():
            return _blockers(with_obstructions(site, EMPTY, rasterise))
        found = load_obstructions(file, site, survey_in(self.record))
        if found.digest not in self._placed:
            self._placed.clear()
            self._placed[found.digest] = _blockers(with_obstructions(site, found, rasterise))
        return self._placed[found.digest]


def plan_on_disk(log: Path) -> PlanOnDisk | None:
    """Return the newest plan of a log; None if there is none, or none that can be read."""
    if (found := read_newest(log, None, SilentProgress())) is None:
        return None
    return PlanOnDisk(found.log)


def sha256_or_none(file: Path) -> str | None:
    """Return the hash of a file; None if it is not there."""
    return sha256_of(file) if file.exists() else None


def _blockers(site: Site) -> tuple[Blocker, ...]:
    return tuple(one for one in site.blockers if one.kind == "obstruction")


def _rounded(value: Any) -> Any:
    """Return plain values with numbers to the millimetre."""
    if isinstance(value, Mapping):
        return {key: _rounded(own) for key, own in value.items()}
    if isinstance(value, list):
        return [_rounded(own) for own in value]
    return round(float(value), _DIGITS) + 0.0 if isinstance(value, int | float) else value
