"""Parts that no crane of the site lifts alone, and which two could together."""

from __future__ import annotations

from collections.abc import Iterator

from bimvox.planning.stage import refused_by_crane
from bimvox.records.lift import Status
from bimvox.records.proof import Remark
from bimvox.remarks import table
from bimvox.remarks.subject import Subject, tonnes
from bimvox.site.tandem import pairs_for, tandem_rules


def tandem_lifts(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every part that two cranes of the site reach together and none carries."""
    site = subject.site
    if not site.has_several_cranes or site.moving is not None:  # of one crane that moves, one set-up exists at a time
        return
    for lift in subject.plan.lifts:
        part = site.components[lift.component]
        if lift.status is not Status.INFEASIBLE or part.lifting.no_gear or refused_by_crane(site, part) is None:
            continue
        if part.tandem is not None or not (pairs := pairs_for(site, part)):
            continue
        found, most = pairs[0], tandem_rules(site.rules).most_share
        first, second = (site.cranes[number].name for number in found.cranes)
        row = table.TANDEM if max(found.used) <= most else table.TANDEM_TOO_HEAVY
        yield row(
            part,
            first=first,
            second=second,
            load=tonnes(found.load_kg[0]),
            other=tonnes(found.load_kg[1]),
            used=100.0 * found.used[0],
            also=100.0 * found.used[1],
            apart=found.apart_m,
            most=100.0 * most,
        )
