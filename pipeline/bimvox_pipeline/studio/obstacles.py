"""The obstruction file of a site in the studio: the boxes that its page edits, and all else as it is."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError

from bimvox.errors import ObstructionFileError
from bimvox.files import read_input, write_atomically
from bimvox.site.config.validation import Point3, Table, Text
from bimvox.site.nested import json_values
from bimvox.site.obstructions.file import BoxEntry, parse_obstructions
from bimvox.units import metres_per
from bimvox_pipeline.studio.opened import SITE_SUFFIX, ChangedMeanwhileError, alone_in
from bimvox_pipeline.studio.setup import impossible

_MOST = 10_000


class _BoxSetup(Table):
    """A box, in metres of the site."""

    id: Text
    min: Point3
    max: Point3


class _Boxes(Table):
    """All boxes of a site."""

    obstructions: Annotated[tuple[_BoxSetup, ...], Field(max_length=_MOST)] = ()


def file_of(site: Path) -> Path:
    """Return the obstruction file of a site file."""
    return site.with_name(site.name.removesuffix(SITE_SUFFIX) + ".obstructions.json")


def boxes_of(site: Path) -> dict[str, Any]:
    """Return the boxes of a site's obstruction file, in metres, and how many other obstructions it has.

    Raises:
        ObstructionFileError: If the file cannot be used.
    """
    document, sha256 = _document(file_of(site))
    scale = metres_per(document["unit"])
    boxes = [
        {"id": one["id"], **{key: [round(value * scale, 6) for value in one["box"][key]] for key in ("min", "max")}}
        for one in document["obstructions"]
        if _is_box(one) and _is_of_the_site(document)
    ]
    found = {"obstructions": boxes, "others": len(document["obstructions"]) - len(boxes)}
    return found if sha256 is None else {**found, "sha256": sha256}


def write_boxes(site: Path, values: object, sha256: object = None) -> dict[str, Any]:
    """Write the boxes of a site's obstruction file; what is no box stays in it.

    Args:
        site: The site file.
        values: The boxes, as the page has them.
        sha256: The hash of the file as the page knows it; None: there was none.

    Raises:
        ChangedMeanwhileError: If the file is not as the page knows it.
        InputError: If a box is impossible, or an id is given twice; nothing is written.
        ObstructionFileError: If the file there cannot be used.
    """
    try:
        boxes = _Boxes.model_validate({"obstructions": values}).obstructions
        for one in boxes:
            BoxEntry(min=one.min, max=one.max)
    except ValidationError as error:
        raise impossible(error, _Boxes, "the obstructions") from None
    file = file_of(site)
    with alone_in(site.parent):
        document, found = _document(file)
        if sha256 != found:
            raise ChangedMeanwhileError(file)
        if not _is_of_the_site(document):
            said = f"it is in coordinates of the {document['coordinates']}; the page draws boxes in metres of the site"
            raise ObstructionFileError(file, said, key="coordinates", hint="edit the file itself")
        scale = metres_per(document["unit"])
        own = [
            {"id": one.id, "box": {"min": [v / scale for v in one.min], "max": [v / scale for v in one.max]}}
            for one in boxes
        ]
        others = [one for one in document["obstructions"] if not _is_box(one)]
        data = (json.dumps({**document, "obstructions": [*others, *own]}, indent=1) + "\n").encode()
        parse_obstructions(data, file.name, file.parent)  # the ordinary reader: ids, reserved names, sizes
        write_atomically(file, data)
        return boxes_of(site)


def _document(file: Path) -> tuple[dict[str, Any], str | None]:
    """Return the content of an obstruction file and its hash; of one that is not there, no obstructions and None."""
    if not os.path.lexists(file):
        return {"version": 1, "unit": "m", "coordinates": "site", "obstructions": []}, None
    data = read_input(file, ObstructionFileError)
    parse_obstructions(data, file.name, file.parent)
    found = json_values(data.decode("utf-8-sig"))
    if not isinstance(found, dict):
        raise ObstructionFileError(file, "is not an obstruction file")
    return {"unit": "m", **found}, hashlib.sha256(data).hexdigest()


def _is_of_the_site(document: dict[str, Any]) -> bool:
    return document.get("coordinates") in (None, "site")


def _is_box(entry: dict[str, Any]) -> bool:
    return set(entry) == {"id", "box"}
