"""A site opened in the studio: what stays while its set-up is tried."""

from __future__ import annotations

import hashlib
import math
import os
import sys
import threading
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Building, Role
from bimvox.bim.kinds.kind import OUT, Correction
from bimvox.bim.read import read_building
from bimvox.errors import InputError
from bimvox.files import read_input, sha256_of
from bimvox.library.set_up_search.placed import PlacedSite
from bimvox.library.site import built_site
from bimvox.progress import SilentProgress
from bimvox.rendering.pictures.picture import PictureOptions, camera_of, coarsened, png_of
from bimvox.rendering.pictures.site import scene_of_site, view_of_site
from bimvox.site.areas import PLAN, hull, union
from bimvox.site.catalogue import every_machine, own_machines
from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.config.file import load_site_config, read_site_file
from bimvox.site.config.site_config import ModelConfig, SiteConfig
from bimvox.site.demand import Rigs, rigs_of
from bimvox.site.guess import complete_config, ground_why, guess_site
from bimvox.site.kind_rows import KindRow, kind_rows
from bimvox.site.machine import cranes_of
from bimvox.site.map_frame import ifc_to_map
from bimvox.site.means import Means
from bimvox.site.start_guess import start_of
from bimvox.site.trial import Trial, Tried
from bimvox_pipeline.studio.setup import Setup, read_setup, set_ups_of, setup_of, with_setup

SITE_SUFFIX = ".site.toml"
_MOST_POINTS = 2000
_SIMPLE_M = 0.05


@dataclass(frozen=True, eq=False)
class Opened(PlacedSite):
    """A site file, or a model with everything guessed.

    Attributes:
        site: The site file; what saving writes if there is none yet.
        content: Its bytes; None if there is none yet.
        given: Its values as the file gives them.
    """

    site: Path
    content: bytes | None
    given: SiteConfig

    @property
    def sha256(self) -> str | None:
        """Hash of the site file; None if there is none yet."""
        return None if self.content is None else hashlib.sha256(self.content).hexdigest()

    @cached_property
    def _rows(self) -> dict[str, int]:
        return {part.id: n for n, part in enumerate(self.parts)}

    @cached_property
    def _listed(self) -> dict[str, str]:
        return {name: entry.global_id for name, entry in self.entries.items()}

    @cached_property
    def setup(self) -> Setup:
        """Its own set-up."""
        return read_setup(self.setup_document)

    @cached_property
    def setup_document(self) -> dict[str, Any]:
        """Its own set-up, as JSON."""
        kinds = {name: entry.kind for name, entry in self.entries.items() if entry.kind is not None}
        return setup_of(self.config, cranes_of(self.config), self.means, kinds)

    @cached_property
    def kinds(self) -> tuple[KindRow, ...]:
        """What its parts are, by type."""
        return kind_rows(self.config, self.building)

    @cached_property
    def trial(self) -> Trial:
        """Its parts, ready to be tried."""
        lifted = [part for part in self.parts if self.means[part.id] == Means.CRANE.value]
        highest_m = rigs_of(self.config, lifted).height_m if lifted else 0.0
        return Trial(self.parts, self.load_top_m, replace(self._rigs, height_m=highest_m))

    @cached_property
    def _rigs(self) -> Rigs:
        return rigs_of(self.config, self.parts)

    @property
    def to_map(self) -> NDArray[np.float64] | None:
        """(4, 4) transform from the site frame to the map; None if the model has no map conversion."""
        found = (
            ifc_to_map(self.building.georeference, self.building.source.unit) if self.building.georeference else None
        )
        return None if found is None else np.array(found) @ self.site_to_ifc

    def with_setup(self, wanted: Setup) -> SiteConfig:
        """Return its values with what a set-up changes.

        Raises:
            InputError: If the set-up is impossible.
        """
        hook_height_m = partial(self.trial.hook_height_m, self.config)
        return with_setup(self.config, self.setup, wanted, hook_height_m, self._listed)

    def tried(self, wanted: Setup) -> dict[str, Any]:
        """Return how a set-up serves the parts, as JSON.

        Raises:
            InputError: If the set-up is impossible.
        """
        if wanted.ground_m not in (None, self.config.model.ground_m):  # every part has another height
            other = replace(self, config=self.config.at_ground(wanted.ground_m))
            return other.tried(wanted)
        config = self.with_setup(wanted)
        cranes = cranes_of(config)
        means, by_crane = {**self.means, **wanted.means}, Means.CRANE.value
        lifts = np.tile([means[name] == by_crane for name in self._rows], (len(cranes), 1))
        names = [one.name for one in set_ups_of(config) or cranes]
        for name, entry in self.entries.items():
            own = entry.setup if config.moves else entry.crane
            if own in names and name in self._rows:
                lifts[[crane != own for crane in names], self._rows[name]] = False
        return _tried(self.trial.of(config, cranes, lifts), list(self._rows), config, cranes)

    def picture(self, wanted: Setup, turn_deg: float, size_px: tuple[int, int]) -> tuple[bytes, list[list[float]]]:
        """Return a picture (PNG) of a set-up: the finished building, the cranes, the areas; and where its ground is.

        The second are the corners of the construction area at the height of the ground, and what a metre up moves
        them: x, y, dx, dy in pixels.

        Args:
            wanted: The set-up.
            turn_deg: How far the eye has gone around the site, counter-clockwise from where the yard is in front.
            size_px: Width and height.

        Raises:
            InputError: If the set-up is impossible.
        """
        config = self.with_setup(wanted)
        site = built_site(config, self.building, {}, SilentProgress()).site
        view = view_of_site(site, view_of_site(site).azimuth_deg + turn_deg)
        scene, options = scene_of_site(site), PictureOptions(size_px=size_px, view=view)
        corners_m = np.array([(x, y, 0.0) for x, y in config.areas.construction or ()]).reshape(-1, 3)
        camera = camera_of(coarsened(scene), options)
        at_px, above_px = (camera.project(corners_m + np.array([0.0, 0.0, up_m]))[:, :2] for up_m in (0.0, 1.0))
        return png_of(scene, options), np.hstack([at_px, above_px - at_px]).round(2).tolist()

    def document(self, relative: str) -> dict[str, Any]:
        """Return everything that the page shows of the site, as JSON."""
        cranes = cranes_of(self.config)
        structure = [one for one in self.placed.elements if one.role is Role.STRUCTURE]
        outline = union([*(hull(one.mesh, PLAN) for one in structure), *self.trial.hulls])
        bounds = [one.mesh.bounds_m for one in self.placed.elements if one.role in (Role.COMPONENT, Role.STRUCTURE)]
        rigs = self._rigs
        tackle_kg = cranes[0].hook_block_kg if cranes else 0.0
        return {
            "path": relative,
            "exists": self.content is not None,
            "name": self.config.name or self.site.name.removesuffix(SITE_SUFFIX),
            "sha256": self.sha256,
            "building": {"outline": _rings(outline), "height_m": round(float(max(box[1, 2] for box in bounds)), 3)},
            "parts": [
                {
                    "id": part.id,
                    "name": part.name or part.id,
                    "class": part.ifc_class,
                    "storey": part.storey or "",
                    "mass_kg": part.mass_kg,
                    "hook_load_kg": round(part.mass_kg + float(rigs.mass_kg[n]) + tackle_kg, 6),
                    "hull": [[round(x, 3), round(y, 3)] for x, y in _ring(self.trial.hulls[n])],
                    "low_m": round(float(part.mesh.bounds_m[0, 2]), 3),
                    "top_m": round(float(part.mesh.bounds_m[1, 2]), 3),
                    "means": self.means[part.id],
                    "kind": part.judgement.kind.value,
                    "kind_from": part.judgement.why,
                }
                for n, part in enumerate(self.parts)
            ],
            "kinds": [row.to_dict() for row in self.kinds],
            "setup": self.setup_document,
            "moves": self.config.moves,
            "ground_why": ground_why(self.config, self.building),
            "machines": [
                {
                    "name": machine.name if machine.file is None else machine.file[0],
                    "kind": machine.kind,
                    "label": f"{machine.name}, {machine.load_moment_tm:.0f} tm",
                    "jibs_m": list(machine.lengths_m),
                    "falls": sorted({crane.falls for crane in machine.cranes}),
                }
                for machine in (*every_machine(), *own_machines(self.config))
            ],
            **self._directions(),
        }

    def _directions(self) -> dict[str, Any]:
        """Return the map's frame as the page wants it, and its north, clockwise from the site's y axis."""
        found = self.to_map
        if found is None:
            return {"north_deg": None, "map": None}
        angle_deg = math.degrees(math.atan2(found[1, 0], found[0, 0]))
        frame = {"eastings_m": float(found[0, 3]), "northings_m": float(found[1, 3]), "x_axis_deg": angle_deg}
        return {"north_deg": angle_deg, "map": frame}


def open_site(path: Path, known: Iterable[Opened] = ()) -> Opened:
    """Return the site of a site file.

    Args:
        path: The site file.
        known: Sites that are open: a model that one of them read, as this file wants it, is not read again.

    Raises:
        BimvoxError: If the file or its model cannot be used.
    """
    content = read_site_file(path)
    given = load_site_config(path, content)
    building = _read_by(known, given) or read_building(given.model.path, given.read_options)
    return Opened(complete_config(given, building), building, path, content, given)


def said_of_parts(config: SiteConfig) -> list[Correction]:
    """Return what a site file says of its parts that the reader of the model must know, wherever it says that."""
    return [
        replace(one, where="")
        for one in config.corrections
        if not one.one_part or one.kind is not None or one.means == OUT
    ]


def _read_by(known: Iterable[Opened], given: SiteConfig) -> Building | None:
    """Return the model of a site as another one has read it; None if none has, or it has changed since."""
    model = given.model.path
    for other in known:
        same = replace(other.given.read_options, corrections=()) == replace(given.read_options, corrections=())
        is_read = other.site.parent / other.given.model.path == model and same
        if is_read and said_of_parts(other.given) == said_of_parts(given):
            return other.building if sha256_of(model) == other.building.source.sha256 else None
    return None


def open_model(path: Path) -> Opened:
    """Return the site of a model with everything guessed, as ``bimvox init`` guesses it; nothing is written.

    Raises:
        BimvoxError: If the model cannot be used.
    """
    building = read_building(path)
    config = guess_site(building, ModelConfig(path=Path(path.name)), name=path.stem)
    config = config.model_copy(update={"calendar": CalendarConfig(start=start_of(building)[0])})
    return Opened(config, building, path.with_name(path.stem + SITE_SUFFIX), None, config)


def unchanged(opened: Opened) -> bool:
    """Return whether a site file and the files that it names are still as they were opened."""
    if opened.content is None:
        return not opened.site.exists()
    named = {opened.site.with_name(name): data for name, data in opened.given.machine_files.items()}
    return all(
        path.exists() and read_input(path) == data for path, data in ({opened.site: opened.content} | named).items()
    )


def _tried(tried: Tried, ids: list[str], config: SiteConfig, cranes: Any) -> dict[str, Any]:
    names = [given.name or crane.name for given, crane in zip(config.cranes, cranes, strict=False)]
    served = tried.crane >= 0
    columns = (_numbers(tried.utilisation, 9), _numbers(tried.radius_m, 3), tried.crane.tolist(), tried.reasons)
    return {
        "parts": {
            name: {"utilisation": share, "radius_m": radius_m, "crane": names[n] if n >= 0 else None, "reason": reason}
            for name, share, radius_m, n, reason in zip(ids, *columns, strict=True)
        },
        "cranes": [
            {
                "name": name,
                "least_m": round(crane.min_radius_m, 3),
                "most_m": round(crane.jib_length_m, 3),
                "height_m": round(crane.jib_height_m, 3),
                "rings": [{"radius_m": round(r.radius_m, 3), "capacity_kg": round(r.capacity_kg, 6)} for r in rings],
            }
            for name, crane, rings in zip(names, cranes, tried.rings, strict=True)
        ],
        "problems": list(tried.problems),
        "served": int(served.sum()),
        "of": int(np.isfinite(tried.radius_m).sum()),
        "highest": round(float(tried.utilisation[served].max(initial=0.0)), 9),
    }


def _numbers(values: NDArray[np.float64], digits: int) -> list[float | None]:
    """Return numbers for JSON; None for those that are not finite."""
    return [value if math.isfinite(value) else None for value in values.round(digits).tolist()]


def _rings(shape: Any) -> list[list[list[float]]]:
    """Return the outer rings of a shape, simplified until they have few enough points."""
    simple_m = _SIMPLE_M
    while True:
        simple = shape.simplify(simple_m)
        polygons = [one for one in getattr(simple, "geoms", [simple]) if one.geom_type == "Polygon"]
        rings = [[[round(x, 3), round(y, 3)] for x, y in one.exterior.coords[:-1]] for one in polygons]
        if sum(map(len, rings)) <= _MOST_POINTS:
            return rings
        simple_m *= 2.0


def _ring(hull: Any) -> list[tuple[float, float]]:
    """Return the corners of a convex hull; of a line or a point, those of its box."""
    if hull.geom_type != "Polygon":
        hull = hull.buffer(0.05, cap_style="square")
    return list(hull.exterior.coords[:-1])


# One at a time: what is checked about the files of a folder still holds when they are written.

_THREADS = threading.Lock()


class ChangedMeanwhileError(InputError):
    """A file that somebody else changed since the page read it: nothing was written."""

    def __init__(self, file: Path) -> None:
        super().__init__(
            f"{file.name} was changed since it was opened here; nothing was saved",
            hint="what you entered is still here",
        )


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Hold a folder: no other thread and no other studio checks and writes a file in it meanwhile.

    The folder itself is locked, so no file is left behind; the system frees it if the process ends. On Windows only
    the threads of this process wait for each other.
    """
    with _THREADS, _locked(folder):
        yield


if sys.platform == "win32":

    def _locked(folder: Path) -> AbstractContextManager[None]:
        """Windows cannot lock a folder."""
        return nullcontext()

else:
    import fcntl

    @contextmanager
    def _locked(folder: Path) -> Iterator[None]:
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            with suppress(OSError):  # a file system of a network may not lock; threads still wait for each other
                fcntl.flock(descriptor, fcntl.LOCK_EX)
            yield
        finally:
            os.close(descriptor)
