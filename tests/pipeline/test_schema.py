import io
import json
from pathlib import Path

import pytest
from bimvox_pipeline.schema import schema
from bimvox_pipeline.voxelize import voxelize

from bimvox.errors import InputError
from bimvox.grid.layout import Archive
from bimvox.progress import SilentProgress

SAMPLES = Path(__file__).parents[2] / "sample_models"


@pytest.mark.parametrize("name", ["site", "obstructions", "grid", "page", "score"])
def test_a_schema_is_a_json_document_of_its_draft(name: str) -> None:
    document = schema(name)
    assert isinstance(document, dict)
    assert document["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert json.loads(json.dumps(document)) == document


def test_the_log_is_described_by_a_proto_file() -> None:
    text = schema("log")
    assert isinstance(text, str)
    assert 'syntax = "proto3";' in text
    assert "message CraneCommand {" in text
    document = schema("log", plain_values=True)
    assert isinstance(document, dict)
    assert {"/tf", "/crane/command"} <= {topic["name"] for topic in document["topics"]}


def test_a_grid_file_is_as_its_schema_says(tmp_path: Path) -> None:
    out = tmp_path / "a.zarr.zip"
    voxelize(SAMPLES / "frame.ifc", out, voxel_size_m=0.2, progress=SilentProgress())
    members = Archive(io.BytesIO(out.read_bytes()), "a.zarr.zip")
    attributes = json.loads(members["zarr.json"])["attributes"]
    document = schema("grid")
    assert isinstance(document, dict)
    assert attributes.keys() == document["properties"].keys() == set(document["required"])
    for key in ("format", "version", "unit"):
        assert attributes[key] == document["properties"][key]["const"]
    part = document["$defs"]["Part"]
    for row in attributes["parts"]:
        assert row.keys() == part["properties"].keys()
        assert row["label"] in part["properties"]["label"]["enum"]
    for key, rule in document["x-arrays"].items():
        meta = json.loads(members[f"{key}/zarr.json"])
        assert (meta["data_type"], meta["dimension_names"]) == (rule["dtype"], rule["dimensions"])


def test_an_unknown_format() -> None:
    with pytest.raises(InputError, match="no format 'lift'"):
        schema("lift")
