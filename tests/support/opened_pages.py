"""Pages of small plans made by hand, and a reader of pages for tests."""

from __future__ import annotations

import base64
import dataclasses
import gzip
import json
import re
import struct
from typing import Any

import numpy as np
from log_building import tiny_log

from bimvox.log.moving import tracks_of
from bimvox.log.plan_log import PlanLog
from bimvox.records.proof import Check, Remark, Severity, Verification
from bimvox.rendering.page.document import DOCUMENT
from bimvox.rendering.page.source import PageSource, Revision

TYPES = {"u8": "u1", "u16": "<u2", "u32": "<u4", "i32": "<i4", "f32": "<f4"}
EVIL = '</script><img src=x onerror="window.hacked=1">\'{{DATA}}'


def passed_proof() -> Verification:
    return Verification((Check("cells", samples=12), Check("capacity", samples=7, worst=0.5, unit="share of capacity")))


def failed_proof(about: str) -> Verification:
    check = Check("cells", about=about)
    check.look(False, f"{about}: is in cells of truck-7")
    return Verification((check,))


def some_remarks(name: str = "Beam", text: str = "nothing carries it", floating: int = 1) -> tuple[Remark, ...]:
    """Remarks of every severity: about the beam, the infeasible column, and the whole plan."""
    return (
        *(Remark("floating", Severity.SERIOUS, f"{text} ({n})", "0GlobalIdBeam", name) for n in range(floating)),
        Remark("hand_load", Severity.MINOR, "a hand carries it", "0GlobalIdColumnB", "ColumnB"),
        Remark("wind", Severity.MINOR, "no wind is considered"),
        Remark("assumed", Severity.NOTE, "the density of concrete", "0GlobalIdColumnA", "ColumnA"),
    )


def revision_of(log: PlanLog, proof: Verification | None = None, remarks: tuple[Remark, ...] = ()) -> Revision:
    return Revision(
        number=log.revision,
        log="tiny.mcap",
        sha256="cd" * 32,
        plan=log.plan,
        context=log.context,
        motions=log.motions,
        tracks=tracks_of(log),
        proof=proof,
        remarks=remarks,
        metadata={**log.metadata, "sha256 site.toml": "ef" * 32},
    )


def tiny_source(
    *, crane: bool = True, proof: Verification | None = None, remarks: tuple[Remark, ...] = ()
) -> PageSource:
    return PageSource((revision_of(tiny_log(crane=crane), proof, remarks),))


def evil_log(*, crane: bool = True) -> PlanLog:
    """Return the tiny log with hostile text wherever a file may contain text."""
    log = tiny_log(crane=crane)
    site = log.plan.site
    components = tuple(
        dataclasses.replace(c, name=EVIL, type_name=EVIL, storey=EVIL, material=EVIL) for c in site.components
    )
    blockers = tuple(dataclasses.replace(b, id=EVIL) if b.kind == "obstruction" else b for b in site.blockers)
    site = dataclasses.replace(
        site, name=EVIL, components=components, blockers=blockers, notes=(EVIL,), source={"name": EVIL, "sha256": EVIL}
    )
    lifts = tuple(
        dataclasses.replace(lift, reason=lift.reason and EVIL, blocked_by=(EVIL,) if lift.blocked_by else ())
        for lift in log.plan.lifts
    )
    plan = dataclasses.replace(log.plan, site=site, lifts=lifts, notes=(EVIL,))
    return dataclasses.replace(log, plan=plan, metadata={"policy": EVIL})


class Opened:
    """Return the data of a page as its program sees them."""

    def __init__(self, page: bytes) -> None:
        self.text = page.decode()
        found = re.search(r'<script type="application/octet-stream" id="data">([^<]*)</script>', self.text)
        assert found
        self.packed = found.group(1)
        data = gzip.decompress(base64.b64decode(self.packed))
        (length,) = struct.unpack("<I", data[:4])
        self.document: dict[str, Any] = json.loads(data[4 : 4 + length])
        DOCUMENT.model.model_validate_json(json.dumps(self.document | {"numbers": ""}))
        self._numbers = data[4 + length :]

    def numbers(self, reference: list[Any]) -> np.ndarray:
        code, offset, count = reference
        return np.frombuffer(self._numbers, TYPES[code], count, offset)

    def columns(self, reference: list[Any], scales: list[float]) -> np.ndarray:
        """Return columns of steps as (N, C) values."""
        steps = self.numbers(reference).reshape(len(scales), -1).astype(np.int64)
        return np.cumsum(steps, axis=1).T / np.array(scales)
