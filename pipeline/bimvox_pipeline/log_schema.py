"""What ``bimvox schema log`` prints: the layout of the log and the definition of its own message."""

from __future__ import annotations

from bimvox.exporters.csv_json import DELIVERY_COLUMNS, LIFT_COLUMNS, SAMPLE_COLUMNS
from bimvox.log import schema as topics

_ATTACHMENTS = {
    topics.SITE_FILE: "the whole site: zip of JSON and .npy",
    topics.PLAN_FILE: "lifts, clashes, notes",
    topics.MOTION_FILE: "spans and phases of the motions; their samples are on /motions",
    topics.URDF_FILE: "the crane as a URDF robot",
    topics.CHART_FILE: "capacity over radius",
    topics.STEPS_FILE: "work that the crane does not do (elapsed time), and the crane's pauses (its clock)",
    topics.CARRIED_OUT_FILE: "of `watch --traffic`: who moved, who decided, what happened",
    topics.REMARKS_FILE: "a list of `kind`, `severity`, `component`, `name`, `text`; not in segments of a watch",
    topics.LAYOUT_FILE: "panels for Foxglove-class viewers",
    "others": "the files that the plan was made from, by name",
}
_TOPICS = topics.topics_of(1, traffic=True)


def log_schema() -> str:
    """Return a .proto file with the layout of the log in its comments."""
    lines = [
        f"bimvox log, schema version {topics.SCHEMA_VERSION}",
        "",
        'MCAP, profile "", zstd chunks of 64 KiB. Times count from the start of the site\'s clock; log time equals',
        "publish time and never falls on a topic. Frame `site`: metres, z up, z = 0 at the top of the ground.",
        "",
        "Topics:",
        *(f"  {topic.name}  {topic.schema}\n      {topic.meaning}" for topic in _TOPICS),
        "",
        f"Metadata record `{topics.METADATA}`: {', '.join(sorted(topics.OWN_METADATA))};",
        "and what the plan was made with (seed, policy, hashes of the input files).",
        "",
        "Attachments:",
        *(f"  {name}  {meaning}" for name, meaning in _ATTACHMENTS.items()),
        "",
        "Columns of the CSV of samples (bimvox export --to csv):",
        *(f"  {name}  {meaning}" for name, meaning in SAMPLE_COLUMNS.items()),
        "",
        "Columns of the CSV of lifts:",
        *(f"  {name}  {meaning}" for name, meaning in LIFT_COLUMNS.items()),
        "",
        "Columns of the CSV of deliveries, a row for each part:",
        *(f"  {name}  {meaning}" for name, meaning in DELIVERY_COLUMNS.items()),
    ]
    comment = "\n".join(f"// {line}".rstrip() for line in "\n".join(lines).split("\n"))
    return f"{comment}\n\n{topics.proto_file()}"


def log_schema_json() -> dict[str, object]:
    """Return the content of :func:`log_schema` as plain values."""
    return {
        "schema_version": topics.SCHEMA_VERSION,
        "topics": [{"name": topic.name, "schema": topic.schema, "meaning": topic.meaning} for topic in _TOPICS],
        "metadata": sorted(topics.OWN_METADATA),
        "attachments": _ATTACHMENTS,
        "csv_samples": SAMPLE_COLUMNS,
        "csv_lifts": LIFT_COLUMNS,
        "csv_deliveries": DELIVERY_COLUMNS,
        "proto": topics.proto_file(),
    }
