#!/bin/sh
# The main job on a sample building: run by `make demo` with bimvox on the PATH and OUT naming the output folder.
set -eu
cd "$(dirname "$0")"
out="${OUT:-demo-output}"
sample=sample_models/prefab.ifc
mkdir -p "$out"

step() {
    printf '\n$ %s\n' "$*"
    "$@"
}

step bimvox voxelize "$sample" -o "$out/prefab.zarr.zip"
step bimvox init "$sample" -o "$out/prefab.site.toml" --force
step bimvox plan "$out/prefab.site.toml" -o "$out/prefab.mcap"
step bimvox verify "$out/prefab.mcap"
step bimvox render "$out/prefab.mcap" -o "$out/prefab.png"

cat <<END

The lift log:   $out/prefab.mcap   (opens in Foxglove, Lichtblick or Rerun)
The picture:    $out/prefab.png
The site file:  $out/prefab.site.toml   (every setting is explained in it)

Try next, with your own model (IFC, STL, OBJ, PLY, GLB ...):
  bimvox inspect MODEL
  bimvox init MODEL && bimvox plan MODEL.site.toml
  bimvox export $out/prefab.mcap --to csv -o lifts.csv
  bimvox watch obstructions.json --site $out/prefab.site.toml
END
