from __future__ import annotations

from bimvox_pipeline.schema import log_schema, log_schema_json

from bimvox.log.schema import proto_file, topics_of

TOPICS = topics_of(1, traffic=True)


def test_the_schema_names_every_topic_and_is_a_proto_file() -> None:
    text = log_schema()
    for topic in TOPICS:
        assert f"{topic.name}  {topic.schema}" in text
    assert text.endswith(proto_file())
    head = text.removesuffix(proto_file()).strip().split("\n")
    assert all(line.startswith("//") for line in head)


def test_the_json_says_the_same() -> None:
    document = log_schema_json()
    assert [topic["name"] for topic in document["topics"]] == [topic.name for topic in TOPICS]  # type: ignore[attr-defined]
    assert document["proto"] == proto_file()
