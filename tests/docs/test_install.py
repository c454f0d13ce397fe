"""How bimvox is installed: torch without CUDA in every documented command, everything pinned, one list of checks."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import metadata
from pathlib import Path

import pytest
import yaml

from supply.sizes import rows_of, table_of

ROOT = Path(__file__).parents[2]
CPU = ("--torch-backend cpu", "download.pytorch.org/whl/cpu", "TORCH_BACKEND: cpu")
INSTALLS = re.compile(r"(?:pip|pipx|uv tool|uv pip) install [^`\n]*(?:\\\n[^\n]*)*")
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "Containerfile",
    ROOT / ".github" / "workflows" / "ci.yml",
    *sorted((ROOT / "docs").rglob("*.md")),
]
FORMS = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))


def _commands() -> list[str]:
    """Every documented command that installs bimvox and what it needs."""
    found = [command for page in PAGES for command in INSTALLS.findall(page.read_text("utf-8"))]
    return [
        command for command in found if re.search(r"bimvox|pyproject|-e \.", command) and "--no-deps" not in command
    ]


def test_every_documented_command_takes_the_cpu_build_of_torch() -> None:
    found = _commands()
    assert len(found) >= 8
    for way in ("uv tool install", "pipx install", "pip install"):
        assert any(command.startswith(way) for command in found)
    # Only these bring torch; the other extras, and bimvox alone, need no option for it.
    with_torch = [one for one in found if re.search(r"\[(full|train)\]|--extra full|-e \.|--group dev", one)]
    assert len(with_torch) >= 7
    assert [one for one in with_torch if not any(cpu in one for cpu in CPU)] == []


def test_the_readme_names_the_full_installation_first() -> None:
    (first, *_) = INSTALLS.findall((ROOT / "README.md").read_text("utf-8"))
    assert "bimvox[full]" in first


@pytest.mark.skipif("+cpu" not in metadata("torch")["Version"], reason="the table is of torch's CPU build")
def test_the_sizes_are_those_of_the_packages() -> None:
    made = table_of(rows_of(tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"])).splitlines()
    text = (ROOT / "docs" / "install.md").read_text("utf-8").splitlines()
    begin = text.index(made[0])
    for line, now in zip(text[begin : begin + len(made)], made, strict=True):
        ours, theirs = (re.findall(r"\d+|[^\d|]+", one) for one in (line, now))
        assert [one for one in ours if not one.isdigit()] == [one for one in theirs if not one.isdigit()], "make sizes"
        sizes = [[int(one) for one in many if one.isdigit()] for many in (ours, theirs)]
        assert sizes[0] == pytest.approx(sizes[1], rel=0.05, abs=1), f"make sizes: {now}"


def test_the_container_takes_locked_packages_and_files_that_exist() -> None:
    text = (ROOT / "Containerfile").read_text("utf-8")
    assert text.count("--require-hashes") == 2
    assert {"-c constraints.txt", "-c constraints-cpu.txt"} <= set(re.findall(r"-c [a-z-]+\.txt", text))
    (python,) = set(re.findall(r"^FROM (\S+)", text, re.M))
    assert ":3.11-" in python, "the hash of torch's CPU build is that for Python 3.11"
    copied = [name for line in re.findall(r"^COPY (?!--from)(.*) \S+$", text, re.M) for name in line.split()]
    assert copied
    allowed = (ROOT / ".dockerignore").read_text("utf-8").splitlines()
    for name in copied:
        assert (ROOT / name).exists(), name
        assert any(Path(name).match(one.removeprefix("!")) for one in allowed if one.startswith("!")), name


def test_public_ci_runs_the_three_systems_with_pinned_actions() -> None:
    text = (ROOT / ".github" / "workflows" / "ci.yml").read_text("utf-8")
    jobs = yaml.safe_load(text)["jobs"]
    systems = jobs["systems"]["strategy"]["matrix"]["system"]
    assert {name.split("-")[0] for name in systems} == {"ubuntu", "macos", "windows"}
    used = re.findall(r"uses: (\S+)( # v\S+)?", text)
    assert used
    for action, version in used:
        assert re.fullmatch(r"[\w./-]+@[0-9a-f]{40}", action), action
        assert version
    for run in re.findall(r"tests/\S+\.py", text):
        assert (ROOT / run).exists()
    assert not any("make " in step.get("run", "") for step in jobs["systems"]["steps"])


def test_pre_commit_runs_what_make_check_runs_before_the_tests() -> None:
    config = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text("utf-8"))
    hooks = [hook["entry"] for repo in config["repos"] for hook in repo["hooks"]]
    makefile = (ROOT / "Makefile").read_text("utf-8")
    wanted = []
    for target in ("lint", "types", "contracts"):
        rule = re.search(rf"^{target}: setup.*\n((?:\t.*\n)+)", makefile, re.M)
        assert rule is not None
        wanted += [line.split(" #")[0].strip().removeprefix("$(BIN)/") for line in rule[1].splitlines()]
    shipped = re.search(r"^SHIPPED = (.*)$", makefile, re.M)
    assert shipped is not None
    assert hooks == [line.replace("$(SHIPPED)", shipped[1]) for line in wanted]


@pytest.mark.parametrize(
    "file", sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml")), ids=lambda file: file.stem
)
def test_issue_templates_are_forms(file: Path) -> None:
    form = yaml.safe_load(file.read_text("utf-8"))
    if file.stem == "config":
        assert all(link["url"].startswith("https://") for link in form["contact_links"])
        return
    assert {"name", "description", "labels", "body"} <= set(form)
    for field in form["body"]:
        assert field["type"] in {"markdown", "textarea", "input"}
        assert field["type"] == "markdown" or {"id", "attributes"} <= set(field)


def test_the_map_of_the_house_names_what_exists() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    for path in re.findall(r"\]\((?!https)([^)#]+)\)", text):
        assert (ROOT / path).exists(), path
    for path in re.findall(r"`((?:bimvox|pipeline|cli|tests|supply|docs)/[\w./-]+)`", text):
        assert (ROOT / path).exists(), path
    folders = {file.name for file in ROOT.iterdir() if (file / "__init__.py").exists()}
    assert folders <= set(re.findall(r"^- `([a-z_]+)", text, re.M))
