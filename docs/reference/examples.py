"""What stands in the pages of commands beyond their help: examples, which the tests run, and where to read on."""

from __future__ import annotations

EXAMPLES: dict[str, tuple[str, ...]] = {
    "demo": ("bimvox demo -o demo-output --json",),
    "voxelize": (
        "bimvox voxelize sample_models/frame.ifc --voxel-size 0.1 -o frame.zarr.zip",
        "bimvox voxelize sample_models/yard.glb --unit m -o yard.zarr.zip --json",
    ),
    "inspect": (
        "bimvox inspect sample_models/frame.ifc",
        "bimvox inspect frame.zarr.zip --json",
        "bimvox inspect frame.mcap",
    ),
    "init": (
        "bimvox init sample_models/frame.ifc -o my.site.toml",
        'bimvox init sample_models/frame.ifc --select "IfcColumn" -o columns.site.toml --json',
    ),
    "crane": ("bimvox crane import ltx-1060.csv --like mobile-60t --json",),
    "cranes": ("bimvox cranes", "bimvox cranes frame.site.toml --crane hammerhead --json"),
    "optimise": ("bimvox optimise frame.site.toml --crane hammerhead-45 --plans 1 --trials 8",),
    "studio": (),
    "train": ("bimvox train frame.site.toml --steps 2000 --seed 1 --json",),
    "plan": (
        "bimvox plan frame.site.toml -o frame.mcap",
        "bimvox plan frame.site.toml --obstructions obstructions.json -o blocked.mcap --json",
    ),
    "sweep": ("bimvox sweep sweep.toml -o frames --jobs 1 --json",),
    "watch": (
        "bimvox watch obstructions.json --site frame.site.toml -o frame.mcap --once",
        "bimvox watch obstructions.json --site frame.site.toml -o frame.mcap --once --json",
    ),
    "export": (
        "bimvox export frame.mcap --to csv -o frame.csv --json",
        "bimvox export frame.mcap --lift 2 -o lift-2.mcap",
        "bimvox export frame.mcap --to ifc --model sample_models/frame.ifc --start 2026-12-01T07:00 -o frame-4d.ifc",
        "bimvox export frame.zarr.zip --to vti -o frame.vti",
    ),
    "verify": ("bimvox verify frame.mcap", "bimvox verify frame.mcap --json"),
    "render": (
        "bimvox render frame.mcap --lift 3 --time 50% --size 640x400 -o lift-3.png",
        "bimvox render frame.mcap -o frame.html --no-proof --json",
    ),
    "report": ("bimvox report frame.mcap -o frame.report.html --json",),
    "schema": ("bimvox schema site", "bimvox schema crane", "bimvox schema log --json"),
    "warm-up": ("bimvox warm-up --json",),
    "policy": ("bimvox policy list --json",),
    "experiment": ("bimvox experiment paper -o results --seeds 1 --mode ours --quick",),
}
"""Commands of the examples by the name of their page; run in this order from the folder that has ``sample_models``."""

READ_ON: dict[str, tuple[tuple[str, str], ...]] = {
    "demo": (("tutorial", "tutorial.md"),),
    "voxelize": (
        ("what exact means", "voxelizing.md"),
        ("what is taken from IFC files", "reading.md"),
        ("the grid file", "formats/grid.md"),
    ),
    "inspect": (("what the parts are", "parts.md"), ("IFC files", "reading.md")),
    "init": (("the site file", "formats/site.md"), ("tutorial", "tutorial.md")),
    "crane": (("importing your crane", "crane-file.md#importing-your-crane"), ("the crane file", "formats/crane.md")),
    "cranes": (("cranes", "cranes.md"), ("the crane file", "formats/crane.md")),
    "optimise": (("choosing a crane", "cranes.md#choosing-a-crane"), ("the site file", "formats/site.md")),
    "studio": (("the studio", "studio.md"), ("the site file", "formats/site.md")),
    "train": (("policies", "generalist.md"), ("their files", "formats.md#policies")),
    "plan": (("tutorial", "tutorial.md"), ("the site file", "formats/site.md"), ("the log", "formats/log.md")),
    "sweep": (("many sites", "scale.md#many-sites-seeds-and-what-ifs"), ("the sweep file", "formats/sweep.md")),
    "watch": (
        ("replanning when something changes", "watching.md"),
        ("describing what is in the way", "obstructions.md"),
        ("the obstruction file", "formats/obstructions.md"),
    ),
    "export": (("handing the plan on", "export.md"), ("the log", "formats/log.md")),
    "verify": (("what verified means", "verified.md"), ("the checks", "checks.md"), ("the log", "formats/log.md")),
    "render": (("pictures, animations, the page", "pictures.md"),),
    "report": (("the report", "pictures.md#the-report"), ("what a lift plan must say", "lift-plan.md")),
    "schema": (("formats", "formats.md"),),
    "warm-up": (("install", "install.md"),),
    "policy": (("policies", "generalist.md"), ("their files", "formats.md#policies")),
    "experiment": (("the paper's experiments", "paper.md"),),
}
"""Titles and paths in ``docs``."""
