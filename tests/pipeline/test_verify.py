import dataclasses
import json
import re

import numpy as np
import pytest
from bimvox_cli.main import run as run_cli
from bimvox_pipeline.export import export
from bimvox_pipeline.plan import plan
from bimvox_pipeline.verify import verify
from seeded_faults import site_file_of

import bimvox
from bimvox.errors import InputError, LogFileError
from bimvox.library.arguments import PolicyWish
from bimvox.library.plan import digests_of
from bimvox.library.plan_value import Plan, write_log_file
from bimvox.log import schema as topics
from bimvox.log.crane_command import CraneCommandMessage
from bimvox.log.mcap.reader import read_contents, read_file
from bimvox.log.mcap.writer import LogWriter
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress
from bimvox.proof.motion import UNITS
from bimvox.proof.plan import verify_plan
from bimvox.site.component import USUAL_LIFTING


def run(log):
    return verify(log, progress=SilentProgress())


def failed(document):
    return {name for name, check in document["checks"].items() if not check["passed"]}


def rewritten(folder, record, name="changed.mcap"):
    write_log_file(folder / name, record)
    return folder / name


def with_messages(folder, change, name="changed.mcap"):
    """Return the log with each message replaced by ``change(topic, data)``."""
    return changed_log(folder / "frame.mcap", folder / name, change)


def changed_log(log, out, change=lambda topic, data: data, *, metadata=(), plan=lambda data: data, of=topics.PLAN_FILE):
    """Write a log with other messages, more metadata, or another plan (or attachment ``of``), and return its path."""
    contents = read_contents(read_file(log), log)
    with out.open("wb") as stream, LogWriter(stream) as writer:
        for key, values in contents.metadata.items():
            writer.metadata(key, {**values, **dict(metadata)})
        for key, data in contents.attachments.items():
            writer.attachment(key, plan(data) if key == of else data)
        for message in contents.messages:
            writer.raw(message.topic, message.sequence, message.time_ns, change(message.topic, message.data))
    return out


def test_a_good_log_is_proven_from_itself_alone(site_folder, tmp_path_factory):
    alone = tmp_path_factory.mktemp("alone") / "log.mcap"
    alone.write_bytes((site_folder / "frame.mcap").read_bytes())
    document = run(alone)
    assert document["verified"] is True, failed(document)
    assert (document["lifts"], document["infeasible_lifts"], document["revision"]) == (8, 0, 0)
    plan_checks = {check.name for check in verify_plan(read_log(alone).plan).checks}
    of_the_log = {"values", "digests", "own_files", "load_poses", "joint_states", "commands", "shown"}
    assert set(document["checks"]) == plan_checks | set(UNITS) | {"motion_margin", "steps", "props"} | of_the_log
    for check in document["checks"].values():
        assert {"passed", "samples", "worst", "unit", "failures"} <= set(check)
        assert check["failures"] == []
    json.dumps(document, allow_nan=False)
    assert "infeasible" not in document


def test_an_extract_is_proven_for_the_lifts_that_it_carries(site_folder):
    export(site_folder / "frame.mcap", lifts=("2", "5"), out=site_folder / "two.mcap", progress=SilentProgress())
    document = run(site_folder / "two.mcap")
    assert document["verified"] is True, failed(document)
    assert (document["lifts"], document["left_out"]) == (2, 6)
    assert document["checks"]["motion_cells"]["samples"] > 0


def test_a_log_with_infeasible_lifts_is_proven_for_the_others(site_folder):
    site = read_log(site_folder / "frame.mcap").plan.site
    part = site.components[0]
    low = site.frame.corner_of(part.target_vox) + 0.05
    box = {"id": "pallet", "box": {"min": low.tolist(), "max": (low + 0.2).tolist()}}
    file = site_folder / "obstructions.json"
    file.write_text(json.dumps({"version": 1, "unit": "m", "obstructions": [box]}))
    out = site_folder / "with.mcap"
    made = plan(
        site_folder / "frame.site.toml", out, obstructions=file, wish=PolicyWish("default"), progress=SilentProgress()
    )
    document = run(out)
    assert document["verified"] is True, failed(document)
    assert document["infeasible_lifts"] == len(made["infeasible"]) > 0


def test_a_site_without_a_crane_is_proven_too(site_folder):
    record = read_log(site_folder / "frame.mcap")
    from bimvox.site.build import labels_of, with_digests

    blockers = tuple(blocker for blocker in record.plan.site.blockers if blocker.kind != "crane")
    rules = dataclasses.replace(record.plan.site.rules, gives_way=(), curing=None, props=None, upend_s=0.0)
    parts = tuple(dataclasses.replace(part, lifting=USUAL_LIFTING) for part in record.plan.site.components)
    site = dataclasses.replace(
        record.plan.site, cranes=(), blockers=blockers, rules=rules, components=parts, access=None
    )
    site = with_digests(dataclasses.replace(site, labels=labels_of(site)))
    text = site_file_of(site)
    bare = dataclasses.replace(
        record,
        plan=dataclasses.replace(record.plan, site=site),
        motions=(),
        attachments={"site.toml": text},
        metadata=digests_of({"site.toml": text}),
    )
    document = run(rewritten(site_folder, bare))
    assert document["verified"] is True, failed(document)


def test_content_that_does_not_fit_its_digests_is_caught(site_folder):
    record = read_log(site_folder / "frame.mcap")
    site = record.plan.site
    light = dataclasses.replace(site.components[0], mass_kg=site.components[0].mass_kg / 2)
    changed = dataclasses.replace(site, components=(light, *site.components[1:]))
    document = run(
        rewritten(site_folder, dataclasses.replace(record, plan=dataclasses.replace(record.plan, site=changed)))
    )
    assert failed(document) == {"digests", "rigging", "gust"}
    assert any("geometry" in failure for failure in document["checks"]["digests"]["failures"])


def test_a_replaced_attached_file_is_caught(site_folder):
    record = read_log(site_folder / "frame.mcap")
    assert "sha256 site.toml" in record.metadata
    other = dataclasses.replace(record, attachments={**record.attachments, "site.toml": b"[model]\n"})
    assert failed(run(rewritten(site_folder, other))) == {"digests", "own_files"}
    gone = dataclasses.replace(record, attachments={})
    assert failed(run(rewritten(site_folder, gone))) == {"digests", "own_files"}


def test_a_motion_and_a_path_that_were_changed_are_caught(site_folder):
    record = read_log(site_folder / "frame.mcap")
    motion = record.motions[3]
    loaded = dataclasses.replace(motion.loaded, radius_m=motion.loaded.radius_m + 0.3)
    motions = tuple(dataclasses.replace(m, loaded=loaded) if m is motion else m for m in record.motions)
    broken = failed(run(rewritten(site_folder, dataclasses.replace(record, motions=motions))))
    assert "ends" in broken
    lift = record.plan.lifts[2]
    path = np.concatenate([lift.path_vox[:4], lift.path_vox[5:]])
    lifts = tuple(dataclasses.replace(x, path_vox=path) if x is lift else x for x in record.plan.lifts)
    spoiled = dataclasses.replace(record, plan=dataclasses.replace(record.plan, lifts=lifts))
    assert "unit_moves" in failed(run(rewritten(site_folder, spoiled)))


def test_props_that_a_log_states_are_proven(site_folder):
    def without_props(data):
        document = json.loads(data)
        for one in document["held"]:
            one.update(hold="bearing", props=[], until_ns=None)
        return json.dumps(document).encode()

    held = json.loads(read_contents(read_file(site_folder / "frame.mcap"), "log").attachments[topics.PROPS_FILE])
    assert any(one["props"] for one in held["held"])
    forged = changed_log(
        site_folder / "frame.mcap", site_folder / "props.mcap", plan=without_props, of=topics.PROPS_FILE
    )
    document = run(forged)
    assert failed(document) == {"props"}
    assert any("what stands needs props" in failure for failure in document["checks"]["props"]["failures"])
    damaged = changed_log(
        site_folder / "frame.mcap", site_folder / "damaged.mcap", plan=lambda data: b'{"held": 3}', of=topics.PROPS_FILE
    )
    with pytest.raises(LogFileError, match="the props in it cannot be read"):
        run(damaged)


def test_poses_and_commands_that_lead_elsewhere_are_caught(site_folder):
    from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

    def shifted(topic, data):
        if topic != topics.LOAD:
            return data
        message = PoseInFrame.FromString(data)
        message.pose.position.x += 0.01
        return message.SerializeToString(deterministic=True)

    def faster(topic, data):
        if topic != topics.COMMAND:
            return data
        message = CraneCommandMessage.FromString(data)
        message.trolley_rate_m_s *= 1.1
        return message.SerializeToString(deterministic=True)

    assert failed(run(with_messages(site_folder, lambda topic, data: data))) == set()
    assert failed(run(with_messages(site_folder, shifted))) == {"load_poses"}
    assert failed(run(with_messages(site_folder, faster))) == {"commands"}


@pytest.mark.parametrize("version", ["0.1.0", "0.1.9", "0.2.0.dev1", "7.0.0", ""])
def test_a_version_whose_logs_this_program_does_not_know_is_refused_by_name(site_folder, version):
    forged = rewritten(site_folder, dataclasses.replace(read_log(site_folder / "frame.mcap"), version=version))
    document = run(forged)
    assert failed(document) == {"digests"}
    assert document["checks"]["digests"]["failures"][0].startswith(
        f"metadata bimvox is {version!r}: this bimvox proves"
    )


@pytest.mark.parametrize("version", ["1", "3", "2.0", ""])
def test_another_schema_version_is_not_read(site_folder, version):
    log = changed_log(site_folder / "frame.mcap", site_folder / "other.mcap", metadata={"schema_version": version})
    with pytest.raises(LogFileError, match=f"has schema version {version}, this bimvox reads 2"):
        run(log)


def test_words_of_a_log_are_compared(site_folder):
    def reworded(topic, data):
        return data.replace(b"lift", b"hook") if topic == topics.LOG else data

    assert failed(run(with_messages(site_folder, reworded))) == {"shown"}


def test_a_key_that_bimvox_does_not_write_is_refused(site_folder):
    log = site_folder / "frame.mcap"
    more = changed_log(log, site_folder / "more.mcap", metadata={"approved_by": "the city"})
    entered = changed_log(log, site_folder / "plan.mcap", plan=lambda data: data.replace(b"{", b'{"by": "all", ', 1))
    for forged, says in (
        (more, "metadata 'approved_by': bimvox writes no such key"),
        (entered, "attached plan.json is not what the plan gives: by is in one of them only"),
    ):
        document = run(forged)
        assert failed(document) == {"shown"}
        assert says in document["checks"]["shown"]["failures"][0]


def test_a_damaged_log_is_refused(site_folder):
    log = site_folder / "frame.mcap"
    log.write_bytes(log.read_bytes()[:-100])
    with pytest.raises(LogFileError, match="truncated"):
        run(log)


def test_the_command_says_what_failed_by_its_exit_code(site_folder, capsys):
    assert run_cli(["verify", str(site_folder / "frame.mcap")]) == 0
    assert "every check passed" in capsys.readouterr().out
    record = read_log(site_folder / "frame.mcap")
    gone = rewritten(site_folder, dataclasses.replace(record, attachments={}))
    assert run_cli(["verify", str(gone), "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert document["verified"] is False
    assert run_cli(["verify", str(gone)]) == 1
    assert "it carries no site.toml" in " ".join(capsys.readouterr().out.split())


def test_a_log_is_compared_with_given_files(site_folder):
    log, site = site_folder / "frame.mcap", site_folder / "frame.site.toml"
    document = verify(log, site=site, progress=SilentProgress())
    assert document["verified"], document["checks"]["bound"]["failures"]
    assert document["bound_to"] == ["site"]
    record = read_log(log)
    part = record.plan.site.components[0]
    sling, ends = part.lifting.rig.parts
    pieces = (
        dataclasses.replace(sling, load_kg=sling.load_kg - 1.0),
        dataclasses.replace(ends, load_kg=ends.load_kg * (1.0 - 1.0 / part.mass_kg)),
    )
    lifting = dataclasses.replace(part.lifting, rig=dataclasses.replace(part.lifting.rig, parts=pieces))
    light = dataclasses.replace(part, mass_kg=part.mass_kg - 1.0, lifting=lifting)
    from bimvox.site.build import with_digests

    parts = (light, *record.plan.site.components[1:])
    spoiled = with_digests(dataclasses.replace(record.plan.site, components=parts))
    metadata = {**record.metadata}
    forged = dataclasses.replace(record, plan=dataclasses.replace(record.plan, site=spoiled), metadata=metadata)
    motions = [  # the lighter part is permitted in less wind
        dataclasses.replace(one, wind=dataclasses.replace(one.wind, speed_m_s=0.99 * one.wind.speed_m_s))
        for one in record.motions
    ]
    path = rewritten(site_folder, dataclasses.replace(forged, motions=tuple(motions)))
    assert run(path)["verified"]
    document = verify(path, site=site, progress=SilentProgress())
    assert failed(document) == {"bound"}
    assert f"{light.label}: mass_kg is {light.mass_kg} in the log" in document["checks"]["bound"]["failures"][0]


def test_a_log_is_compared_with_a_model_elsewhere_and_its_obstructions(site_folder):
    record = read_log(site_folder / "frame.mcap")
    far = {"id": "skip", "box": {"min": [-1.0, -1.0, 0.0], "max": [0.0, 0.0, 0.4]}}
    file = site_folder / "skip.json"
    file.write_text(json.dumps({"version": 1, "unit": "m", "obstructions": [far]}))
    (site_folder / "frame.ifc").rename(site_folder / "moved.ifc")
    given = {"site": site_folder / "frame.site.toml", "model": site_folder / "moved.ifc"}
    bound = bimvox.verify(site_folder / "frame.mcap", **given)
    assert bound.verified, bound.failures
    assert bound.checks[-1].name == "bound"
    missing = bimvox.verify(site_folder / "frame.mcap", obstructions=file)
    assert missing.failures == ("bound: fixed object 'skip' is not in the log, but in your files",)
    with pytest.raises(InputError, match="--model needs --site"):
        bimvox.verify(Plan(record), model=given["model"])


@pytest.mark.parametrize(
    ("check", "forge", "says"),
    [
        (
            "unit_moves",
            lambda lift: {"path_vox": np.delete(lift.path_vox, 5, axis=0)},
            r"{part}: move 4 is not one cell",
        ),
        (
            "margin",
            lambda lift: {"clearance_m": 99.0},
            r"{part}: keeps a transit_clearance_m|{part}: keeps a clearance_m",
        ),
        ("unit_moves", lambda lift: {"path_vox": lift.path_vox[1:]}, r"{part}: its path starts at \("),
    ],
)
def test_a_failure_names_the_part_and_writes_numbers_without_brackets(site_folder, check, forge, says):
    record = read_log(site_folder / "frame.mcap")
    lift = record.plan.lifts[2]
    part = record.plan.site.components[lift.component]
    lifts = (*record.plan.lifts[:2], dataclasses.replace(lift, **forge(lift)), *record.plan.lifts[3:])
    document = run(
        rewritten(site_folder, dataclasses.replace(record, plan=dataclasses.replace(record.plan, lifts=lifts)))
    )
    told = document["checks"][check]["failures"]
    assert part.name != part.id
    assert any(re.match(says.format(part=re.escape(f"{part.name} ({part.id})")), one) for one in told), told
