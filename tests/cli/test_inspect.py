from pathlib import Path

from bimvox_cli.main import app
from typer.testing import CliRunner

SAMPLES = Path(__file__).parents[2] / "sample_models"


def test_every_crane_of_a_site_is_listed():
    said = CliRunner().invoke(app, ["inspect", str(SAMPLES / "hall.site.toml")])
    assert said.exit_code == 0
    lines = [line.split() for line in said.stdout.splitlines() if line.startswith("crane ")]
    assert lines == [["crane", "1", "name", "west"], ["crane", "2", "name", "east"]]
    one = CliRunner().invoke(app, ["inspect", str(SAMPLES / "yard.site.toml")])
    assert [line.split()[:2] for line in one.stdout.splitlines() if line.startswith("crane ")] == [["crane", "name"]]
