"""The runs that a sweep file requests."""

from __future__ import annotations

from pathlib import Path

import pytest
from bimvox_pipeline.fleet.runs import Wish, digest_of, load_sweep, runs_of

from bimvox.errors import ConfigError


def loaded(folder: Path, text: str) -> tuple[Wish, ...]:
    file = folder / "sweep.toml"
    file.write_text(text)
    return load_sweep(file)


def test_a_cross_product_and_a_list(tmp_path: Path):
    for name in ("a.site.toml", "b.site.toml"):
        (tmp_path / name).touch()
    found = loaded(
        tmp_path,
        'sites = ["*.site.toml"]\nseeds = [0, 1]\nobstructions = ["none", "truck.json"]\nsteps = 2000\n'
        '[[run]]\nsite = "c.site.toml"\nseed = 7\npolicy = "none"\n',
    )
    a, b, truck = tmp_path / "a.site.toml", tmp_path / "b.site.toml", tmp_path / "truck.json"
    crossed = [Wish(s, o, n, None, 2000) for s in (a, b) for o in (None, truck) for n in (0, 1)]
    assert list(found) == [*crossed, Wish(tmp_path / "c.site.toml", None, 7, "none", 2000)]
    assert [run.name for run in runs_of(found)] == [
        *("a-seed0", "a-seed1", "a-truck-seed0", "a-truck-seed1"),
        *("b-seed0", "b-seed1", "b-truck-seed0", "b-truck-seed1"),
        "c-seed7",
    ]
    # The first run of those that share a policy goes first; the others find the policy in the store.
    assert [run.leads for run in runs_of(found)] == [True, True, False, False, True, True, False, False, True]


def test_names_are_each_once(tmp_path: Path):
    wishes = [Wish(tmp_path / folder / "x.site.toml") for folder in ("a", "b", "a")]
    names = [run.name for run in runs_of([*wishes, Wish(tmp_path / "y.site.toml")])]
    assert len(names) == len(set(names)) == 3
    assert names[-1] == "y"
    assert all(name.startswith("x-") for name in names[:2])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('site = ["a"]', "unknown key"),
        ("seeds = [-1]", r"seeds\[0\]"),
        ('sites = "a.toml"', "expected a list"),
        ("sites = [", "not TOML"),
        ("version = 2", "version"),
        ('sites = ["no-*.toml"]', r"sites\[0\]: no file matches"),
        ("seeds = [1]", "names no runs"),
        ("[[run]]\nseed = 1", r"run\[0\].site is missing"),
    ],
)
def test_errors_are_reported_with_their_place(tmp_path: Path, text: str, message: str):
    with pytest.raises(ConfigError, match=message):
        loaded(tmp_path, text)


def test_the_digest_follows_contents_and_nothing_else(sites: Path, tmp_path_factory: pytest.TempPathFactory):
    wish = Wish(sites / "paper.site.toml", sites / "beside.json", 1, "none", 100)
    before = digest_of(wish)
    other = tmp_path_factory.mktemp("other")
    for file in sites.iterdir():
        (other / file.name).write_bytes(file.read_bytes())
    assert digest_of(Wish(other / "paper.site.toml", other / "beside.json", 1, "none", 100)) == before
    changed = [
        Wish(wish.site, wish.obstructions, 2, "none", 100),
        Wish(wish.site, wish.obstructions, 1, None, 100),
        Wish(wish.site, wish.obstructions, 1, "none", 101),
        Wish(wish.site, None, 1, "none", 100),
    ]
    assert len({before, *map(digest_of, changed)}) == 5
    for name in ("paper.ifc", "paper.site.toml", "beside.json"):
        content = (sites / name).read_bytes()
        (sites / name).write_bytes(content + b"\n")
        assert digest_of(wish) != before
        (sites / name).write_bytes(content)
    ply = "ply\nformat ascii 1.0\nelement vertex 1\n" + "".join(f"property float {a}\n" for a in "xyz") + "end_header\n"
    (sites / "scan.ply").write_text(f"{ply}1 1 1\n")
    (sites / "beside.json").write_text('{"version": 1, "obstructions": [{"id": "s", "points": "scan.ply"}]}')
    referring = digest_of(wish)
    (sites / "scan.ply").write_text(f"{ply}1 1 2\n")
    assert digest_of(wish) != referring


def test_the_digest_follows_the_programme_of_the_site(sites: Path):
    site, programme = sites / "paper.site.toml", sites / "ours.xml"
    site.write_text(site.read_text() + '\n[sequence]\nprogramme = "ours.xml"\n')
    programme.write_text("one")
    before = digest_of(Wish(site))
    programme.write_text("two")
    assert digest_of(Wish(site)) != before
