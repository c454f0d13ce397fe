import hashlib
import json
from pathlib import Path

import pytest
from bimvox_pipeline.inspect.inspect import inspect
from log_building import log_bytes, tiny_log

from bimvox.errors import LogFileError
from bimvox.progress import SilentProgress


@pytest.mark.parametrize("crane", [True, False])
def test_a_log_is_described(tmp_path: Path, crane: bool) -> None:
    log = tiny_log(crane=crane)
    path = tmp_path / "lifts.bin"
    path.write_bytes(log_bytes(log))
    document = inspect(path, SilentProgress())
    assert (document["kind"], document["revision"]) == ("log", 3)
    assert document["recovered"] is False
    assert document["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert document["messages"] == sum(row["messages"] for row in document["topics"])
    assert [lift["order"] for lift in document["lifts"]] == [lift.order for lift in log.plan.lifts]
    assert document["planned"] + document["infeasible"] == len(log.plan.lifts)
    assert (document["duration_s"] is not None) is crane
    files = {row["file"]: row["sha256"] for row in document["attachments"]}
    for name, content in log.attachments.items():
        assert files[name] == hashlib.sha256(content).hexdigest()
    assert document["metadata"]["policy"] == "p-123"
    assert json.loads(json.dumps(document, allow_nan=False)) == document


def test_a_truncated_log_says_how_to_recover_it(tmp_path: Path) -> None:
    path = tmp_path / "lifts.mcap"
    path.write_bytes(log_bytes(tiny_log())[:-100])
    with pytest.raises(LogFileError, match="truncated") as caught:
        inspect(path, SilentProgress())
    assert "--recover" in str(caught.value.hint)
