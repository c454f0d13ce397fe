import dataclasses

from planned_frame import FILES, planned

from bimvox.library.attached_files import check_attached_files
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import read_log
from bimvox.site.component import Component, Lifting


def with_lifting(log: PlanLog, lifting_of) -> PlanLog:
    parts = [dataclasses.replace(part, lifting=lifting_of(part)) for part in log.plan.site.components]
    site = dataclasses.replace(log.plan.site, components=tuple(parts))
    return dataclasses.replace(log, plan=dataclasses.replace(log.plan, site=site))


def about_gear(log: PlanLog) -> list[str]:
    return [text for text in check_attached_files(log).failures if "gear" in text]


def test_a_log_whose_site_file_has_gear_chosen_must_have_it():
    log = read_log(planned() / FILES[1])
    assert all(part.lifting.rig is not None for part in log.plan.site.components)
    assert about_gear(log) == []

    def without(part: Component) -> Lifting:
        return dataclasses.replace(part.lifting, rig=None)

    assert "has gear chosen for it, but it has none" in about_gear(with_lifting(log, without))[0]
