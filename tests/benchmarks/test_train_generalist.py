from __future__ import annotations

import pytest

from benchmarks.train_generalist import main


@pytest.mark.parametrize("device", ["cuda:99", "auto"])
def test_a_missing_device_is_an_error_before_any_lesson_is_made(device, tmp_path, capsys):
    with pytest.raises(SystemExit) as caught:
        main(["--device", device, "--out", str(tmp_path / "weights")])
    assert caught.value.code == 2
    told = capsys.readouterr()
    assert f"device '{device}' cannot be trained on" in told.err
    assert told.out == ""
    assert not (tmp_path / "weights").exists()
