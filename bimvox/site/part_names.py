"""How parts are named to people: name or class first, id second."""

from __future__ import annotations

import re
from collections.abc import Mapping

from bimvox.bim.building import part_name as part_name
from bimvox.site.site import Site


def names_by_id(site: Site) -> dict[str, str]:
    """Return the name of every part and of every structure that has one, by its id."""
    structure = {one.id: part_name(one.id, one.name) for one in site.blockers if one.name}
    return structure | {part.id: part_name(part.id, part.name, part.ifc_class) for part in site.components}


def with_names(text: str, names: Mapping[str, str]) -> str:
    """Return a text in which the ids of parts are replaced by their names; an id in brackets stays."""
    longest_first = sorted(names, key=len, reverse=True)
    if not longest_first:
        return text
    known = "|".join(re.escape(id_) for id_ in longest_first)
    return re.sub(rf"(?<![\w$#(])(?:{known})(?![\w$#])", lambda found: names[found[0]], text)
