"""The data of the page as one JSON document; ``bimvox schema page`` prints its schema."""

from __future__ import annotations

import base64
import json
from typing import Annotated, Any, Literal

from pydantic import Field

from bimvox.rendering.page.document import document_of
from bimvox.rendering.page.schema_lifts import PageDelivery, PageLift, PageMotion
from bimvox.rendering.page.schema_things import (
    Count,
    PageColours,
    PageCrane,
    PageGeometry,
    PagePart,
    PageSite,
    PageStanding,
)
from bimvox.rendering.page.source import PageSource
from bimvox.site.config.validation import Table

Light = Literal["clean", "remarked", "serious", "refused", "plain"]


class PageCheck(Table):
    """A check of the proof."""

    name: str
    """Its name."""
    passed: bool
    """Whether it passed."""
    samples: Count
    """How many values it looked at."""
    worst: float | None
    """The worst of them."""
    unit: str
    """Its unit."""
    failed: Count
    """How many failed."""
    failures: tuple[str, ...]
    """What failed, in words."""


class PageNotCurrent(Table):
    """A lift that is proven against earlier obstructions only."""

    order: Count
    """Its position in the sequence."""
    number: Count
    """Its number."""
    component: str
    """Id of its part."""
    name: str
    """Name of its part."""


class PageClaim(Table):
    """What the log states and the proof has taken as true."""

    name: str
    """Its short stable name."""
    text: str
    """What is claimed."""
    count: int | None = None
    """How many things it is about; without it, the whole plan."""
    bind_with: str | None
    """The option of `bimvox verify` that proves it; null: none."""


class PageProof(Table):
    """A proof."""

    verified: bool
    """Whether every check passed."""
    checks: tuple[PageCheck, ...]
    """Its checks."""
    not_current: tuple[PageNotCurrent, ...]
    """Lifts that it proves against earlier obstructions only."""
    claims: tuple[PageClaim, ...]
    """What the log states and it has taken as true."""


class PageVerdict(Table):
    """The verdict in words, each with its light."""

    proof: str
    """Whether it is proven."""
    proof_light: Light
    """Its light."""
    remarks: str
    """How many remarks there are."""
    remarks_light: Light
    """Their light."""


class PageRemark(Table):
    """A remark."""

    kind: str
    """Its rule."""
    severity: Literal["serious", "minor", "note"]
    """How much it matters."""
    component: str | None
    """Id of its part; null: the whole plan."""
    name: str | None
    """Name of its part."""
    text: str
    """The remark."""


class PageClash(Table):
    """Two parts that overlap in the model."""

    first: str
    """Id of one."""
    second: str
    """Id of the other."""
    depth_m: float
    """How deep."""
    at_least: bool
    """Whether it may be deeper."""


class PageChanges(Table):
    """What a revision changes."""

    since: Count
    """Number of the revision before."""
    kept: tuple[Count, ...]
    """Parts whose lifts are kept."""
    replanned: tuple[Count, ...]
    """Parts whose lifts are new."""
    infeasible: tuple[Count, ...]
    """Parts whose lifts are infeasible."""
    changed_cells: Count
    """Cells of obstructions that differ."""


class PageRevision(Table):
    """One plan of the site."""

    number: Count
    """Its revision number."""
    log: str
    """Name of its log."""
    sha256: str
    """SHA-256 of that file."""
    digest: str
    """Digest of the site with its obstructions."""
    planned: Count
    """Lifts that are planned."""
    infeasible: Count
    """Lifts that are infeasible."""
    carried: Count
    """Lifts that the log carries."""
    begins_s: float
    """When the first motion begins, crane time."""
    ends_s: float
    """When the last one ends."""
    timed: bool
    """Whether a crane moves the loads; otherwise times are nominal."""
    critical_share: float
    """Share of the capacity from which a lift is critical."""
    elapsed_s: float | None
    """Elapsed time, if there is work that the crane does not do."""
    paused_s: float
    """How long the crane pauses."""
    dates: tuple[tuple[float, float, float], ...] = ()
    """Of each block of lifts: begin and end, crane time, and its begin in local time, seconds after 1970."""
    deliveries: tuple[PageDelivery, ...] = ()
    """What the crane unloads; none if no place for trucks is known."""
    lifts: tuple[PageLift, ...]
    """All lifts in their order."""
    obstructions: tuple[PageStanding, ...]
    """Its obstructions."""
    obstruction_notes: tuple[str, ...]
    """Notes about them."""
    notes: tuple[str, ...]
    """Notes about the plan."""
    clashes: tuple[PageClash, ...]
    """Parts that overlap in the model."""
    proof: PageProof | None
    """The proof made for this page; null: none."""
    verdict: PageVerdict
    """The verdict."""
    conditions: tuple[str, ...]
    """What the proof takes as given."""
    remarks: tuple[PageRemark, ...]
    """What a person should look at."""
    changes: PageChanges | None
    """What it changes; null for the first."""
    metadata: dict[str, str]
    """Metadata of the log."""


class PageScales(Table):
    """Steps in keyframes for each unit."""

    time: Count
    """For a second."""
    length: Count
    """For a metre."""
    angle: Count
    """For a radian."""


class PageData(Table):
    """What the page of ``bimvox render`` shows. Lengths in metres, in the site's frame; times in seconds.

    A list ``[type, offset, count]`` refers to little-endian values in ``numbers``: ``u8``, ``u16``, ``u32``, ``i32``
    or ``f32``, the offset in bytes.
    """

    format: Literal[1]
    """Version of this format."""
    site: PageSite
    """Grid, model and ground."""
    colours: PageColours
    """Of states and kinds."""
    crane: PageCrane | None
    """The (first) crane."""
    other_cranes: tuple[PageCrane, ...] = ()
    """The others."""
    geometries: tuple[PageGeometry, ...]
    """Shapes."""
    parts: tuple[PagePart, ...]
    """Parts."""
    standing: tuple[PageStanding, ...]
    """Existing structure."""
    revisions: Annotated[tuple[PageRevision, ...], Field(min_length=1)]
    """Plans of the site, the newest last."""
    left_out: Count
    """How many earlier ones are left out."""
    scales: PageScales
    """Steps of the keyframes."""
    motions: tuple[PageMotion, ...]
    """Motions, each once."""
    numbers: str
    """All numbers that the others refer to, base64."""


def page_json(source: PageSource) -> bytes:
    """Return the data of a page as one JSON document, UTF-8, as ``page_json_schema`` describes it."""
    document, numbers = document_of(source)
    document["numbers"] = base64.b64encode(numbers).decode()
    return json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode() + b"\n"


def page_json_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the page's data."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **PageData.model_json_schema()}
