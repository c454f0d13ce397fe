"""A user's own machine: a machine of the catalogue under another name."""

from __future__ import annotations

from importlib import resources


def machine_text(name: str, of: str) -> bytes:
    """Return the file of a machine of the catalogue with a name of its own."""
    text = (resources.files("bimvox") / "crane" / "catalogue" / f"{of}.toml").read_text(encoding="utf-8")
    return text.replace(f'name = "{of}"', f'name = "{name}"').encode()


SHEET = """
name = "MX 60"
kind = "mobile"
about = "mobile crane with charts as its data sheet prints them; not a maker's machine"
mast_size_m = 7
sling_m = 2.5
rigging_mass_kg = 100
max_wind_m_s = 9
rated_percent = 75
standard = "EN 13000"
slewing = { rate_rad_s = 0.157, acceleration_rad_s2 = 0.005, jerk_rad_s3 = 0.005 }
hoist = { rate_m_s = 0.5, acceleration_m_s2 = 0.3, jerk_m_s3 = 0.3 }
deduction = [{ name = "jib stowed on the boom", mass_kg = 400 }]

[luffing]
pivot_offset_m = -1.2
pivot_height_m = 2.6
luff_deg = [25, 80]
luffing = { rate_rad_s = 0.02, acceleration_rad_s2 = 0.01, jerk_rad_s3 = 0.01 }
tail_radius_m = 3.9
tail_low_m = 1.3
tail_width_m = 2.6
width_m = 1

[masses]
carrier_kg = 24000
carrier_ahead_m = 0.4
superstructure_kg = 9000
superstructure_ahead_m = -0.5
boom_kg = 7000

[[outriggers]]
name = "full"
front_m = 3.6
rear_m = 3.2
left_m = 3.3
right_m = 3.3

[[outriggers]]
name = "half"
front_m = 3.6
rear_m = 3.2
left_m = 2.2
right_m = 2.2

[[sector]]
name = "over rear"
deg = [150, 210]

[[reeving]]
falls = 4
most_kg = 16000
hook_block_kg = 250

[[reeving]]
falls = 8
hook_block_kg = 450

[[table]]
counterweight_kg = 12000
outriggers = "full"
lengths_m = [18, 30, 36]
rows = [
  [4, 30400, 0, 0],
  [6, 20400, 14400, 0],
  [10, 10400, 10400, 9400],
  [16, 0, 5400, 4900],
  [26, 0, 2400, 2400],
]

[[table]]
counterweight_kg = 12000
outriggers = "full"
sector = "over rear"
lengths_m = [30]
rows = [[6, 14400], [10, 12400], [16, 7400], [26, 3400]]

[[table]]
counterweight_kg = 4000
outriggers = "half"
lengths_m = [18]
rows = [[4, 15400], [6, 9400], [10, 4400]]
"""
"""A mobile crane with charts by boom length, counterweight, outriggers, sector and reeving."""
