"""What a log says, read without the page: its exports, its verification and its attachments.

Sums and the load chart are written a second time here, because a page must not be compared with itself.
"""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from number_words import (
    clock,
    counted,
    date,
    fixed,
    metres,
    percent,
    point,
    sentence,
    short_clock,
    span,
    tonnes,
)

from bimvox.log.reader import read_log

Row = tuple[str, str]
S = 1e-9


def when(lift: dict[str, Any], key: str, clock_key: str) -> str:
    """When something is, in words; without a crane on the clock of the log."""
    return str(lift[f"{key}_in_words"] or clock(lift[clock_key]))


class Logged:
    """What a log says."""

    def __init__(self, log: Path) -> None:
        self.log = log
        self.json = self._told("export", log, "--to", "json", "-o", log.with_suffix(".told.json"), "-q")
        self.verified = self._told("verify", log, "--json")
        with log.open("rb") as stream:
            reader = make_reader(stream)
            self.files = {one.name: one.data for one in reader.iter_attachments()}
        self.plan = json.loads(self.files["plan.json"])
        self.motions = {
            one["order"]: one for one in json.loads(self.files.get("motions.json", '{"motions": []}'))["motions"]
        }
        self.site = read_log(log).plan.site
        self.parts = {part.id: part for part in self.site.components}
        self.lifts = self.json["lifts"]
        self.planned = [lift for lift in self.lifts if lift["start_s"] is not None]
        self.remarks = self.verified["remarks"]

    @staticmethod
    def _told(*arguments: Any) -> Any:
        command = [sys.executable, "-m", "bimvox_cli", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if "-o" not in arguments:
            return json.loads(done.stdout)
        assert done.returncode == 0, done.stderr
        return json.loads(arguments[arguments.index("-o") + 1].read_text(encoding="utf-8"))

    @cached_property
    def charts(self) -> list[dict[str, Any]]:
        names = ["load_chart.json", *(f"crane_{n}.load_chart.json" for n in range(2, len(self.site.cranes) + 1))]
        return [json.loads(self.files[name]) for name in names if name in self.files]

    def crane_of(self, lift: dict[str, Any]) -> int:
        return int(self.motions[lift["order"]].get("crane", 0))

    def hung_kg(self, lift: dict[str, Any]) -> float:
        chart = self.charts[self.crane_of(lift)]
        return float(lift["mass_kg"]) + chart["hook_block_kg"] + lift["rigging_mass_kg"]

    def held(self, lift: dict[str, Any]) -> dict[str, Any]:
        """The samples of a lift while its load is on the hook."""
        motion, samples = self.motions[lift["order"]], lift["samples"]
        time_s = np.array(samples["time_s"])
        since_s = time_s - motion["start_ns"] * S
        inside = (since_s > motion["raising"]["start_ns"] * S - 1e-6) & (
            since_s < motion["loaded"]["end_ns"] * S + 1e-6
        )
        return {
            "time_s": time_s[inside],
            **{key: np.array(samples[key])[inside] for key in ("slew_rad", "radius_m", "hook_height_m")},
        }

    def governing(self, lift: dict[str, Any]) -> dict[str, float]:
        """The sample with the highest utilisation, by the capacity at the next listed radius."""
        held, chart = self.held(lift), self.charts[self.crane_of(lift)]
        n = int(np.argmax(held["radius_m"]))  # the capacity never grows with the radius
        radius = float(held["radius_m"][n])
        listed = zip(chart["radius_m"], chart["capacity_kg"], strict=True)
        capacity = next(kg for at, kg in listed if radius <= at + 1e-6)
        load = self.hung_kg(lift)
        return {
            "share": load / capacity,
            "radius_m": radius,
            "kg": capacity,
            "load_kg": load,
            "time_s": float(held["time_s"][n]),
        }

    def hook(self, lift: dict[str, Any], n: int) -> list[Row]:
        """Radius, slew and position of the hook when it picks (0) or sets (-1)."""
        held, base = self.held(lift), self.site.cranes[self.crane_of(lift)].base_m
        slew, radius, height = (float(held[key][n]) for key in ("slew_rad", "radius_m", "hook_height_m"))
        at = (base[0] + radius * math.cos(slew), base[1] + radius * math.sin(slew), height)
        return [
            ("Pick point" if n == 0 else "Set point", point(at)),
            ("at", f"radius {metres(radius)}, slew {fixed(math.degrees(slew), 1)}°"),
        ]

    @cached_property
    def trucks(self) -> dict[int, dict[str, Any]]:
        return {truck["truck"] - 1: truck for truck in self.json["deliveries"]}

    def unloading(self, lift: dict[str, Any]) -> dict[str, Any] | None:
        truck = self.trucks.get(lift["delivery"])
        row = next((one for one in truck["parts"] if one["component"] == lift["component"]), None) if truck else None
        return row if row and row["truck_radius_m"] is not None else None

    def truck_words(self, number: int) -> list[str]:
        """A delivery in words; nothing if the crane does not unload it."""
        truck = self.trucks[number]
        own = [one for one in truck["parts"] if one["truck_radius_m"] is not None]
        if not own:
            return []
        words = [
            f"Delivery {number + 1}: {counted(len(own), 'part')} unloaded by the crane",
            f"{span(sum(one['unloading_s'] for one in own))} of the crane before its first lift",
            f"radius up to {metres(max(one['truck_radius_m'] for one in own))}, "
            f"up to {percent(max(one['truck_utilisation'] for one in own))} of the capacity",
        ]
        if truck["unloaded"]:
            begins = next(d for d in self.json["calendar"]["deliveries"] if d["delivery"] == number)["arrives"]
            words.append(f"{date(begins)} to {date(truck['unloaded'])}")
        return words

    @cached_property
    def begins_s(self) -> float:
        return min((lift["start_s"] for lift in self.planned), default=0.0)

    @cached_property
    def ends_s(self) -> float:
        return max((lift["start_s"] + lift["duration_s"] for lift in self.planned), default=0.0)

    @property
    def digits(self) -> int:
        """Digits of lengths that are whole cells."""
        return 2 if round(self.json["frame"]["voxel_size_m"] * 1000) % 10 == 0 else 3

    def part_rows(self, lift: dict[str, Any]) -> list[Row]:
        part = self.parts[lift["component"]]
        cell = self.json["frame"]["voxel_size_m"]
        size = " × ".join(fixed(n * cell, self.digits) for n in part.shape.size_vox)
        return [
            ("GlobalId", lift["global_id"]),
            ("Id", "" if lift["component"] == lift["global_id"] else lift["component"]),
            ("Class", lift["ifc_class"]),
            ("Type", part.type_name or ""),
            ("Storey", part.storey or ""),
            ("Material", part.material or ""),
            ("Mass", tonnes(lift["mass_kg"])),
            ("Mass from", "volume × usual density of its kind" if part.mass_source == "default" else ""),
            ("Cells", f"{len(part.shape.cells):,}"),
            ("Size", f"{size} m"),
        ]

    def lift_rows(self, lift: dict[str, Any]) -> list[Row]:
        """The rows of a planned lift."""
        rows: list[Row] = []
        motion = self.motions.get(lift["order"])
        if motion is not None:
            use, chart = self.governing(lift), self.charts[self.crane_of(lift)]
            area = next(one for one in self.plan["lifts"] if one["order"] == lift["order"])["lifting"]["sail_area_m2"]
            drag = self.site.rules.drag_coefficient
            # FEM 1.004: a load of 1 t on 1 m2 with a drag coefficient of 1.2 has the crane's own limit.
            wind = chart["max_wind_m_s"] * min(1.0, math.sqrt(1.2 * use["load_kg"] / 1000 / (area * drag)))
            carrying = (motion["loaded"]["end_ns"] - motion["loaded"]["start_ns"]) * S
            rows += [
                ("Utilisation", f"{fixed(use['share'] * 100, 1)} %"),
                ("On the hook", f"{tonnes(use['load_kg'])} with rigging and hook block"),
                ("Gross capacity", f"{tonnes(use['kg'])} at {metres(use['radius_m'])}"),
                ("Permitted wind", f"up to {fixed(wind, 1)} m/s"),
                ("Governing sample", f"{span(use['time_s'] - lift['start_s'])} after it begins"),
                ("Begins", when(lift, "begins", "start_s")),
                ("Whole lift", span(lift["duration_s"])),
                ("Heading", lift["heading"] or ""),
                ("Carrying", span(carrying)),
                ("Bound", f"{span(lift['bound_s'])} ({fixed(carrying / lift['bound_s'], 2)} ×)"),
            ]
        elif lift["duration_s"] is not None:
            whole = f"{span(lift['duration_s'])} (nominal, 1 s per move)"
            rows += [("Begins", when(lift, "begins", "start_s")), ("Whole lift", whole)]
        shortest = lift["shortest_moves"]
        rows += [
            (
                "Moves",
                f"{lift['moves']:,} cells"
                + (f" ({fixed(lift['moves'] / shortest, 2)} × shortest)" if shortest else ""),
            ),
            ("Shortest", f"{shortest:,} cells" if shortest is not None else ""),
            ("In contact", f"last {counted(lift['contact_moves'], 'placement')}" if lift["contact_moves"] else ""),
            ("Delivery", "" if lift["delivery"] is None else f"no. {lift['delivery'] + 1}"),
        ]
        if row := self.unloading(lift):
            rows += [
                ("Radius", metres(row["truck_radius_m"])),
                ("Utilisation", f"{fixed(row['truck_utilisation'] * 100, 1)} %"),
                ("Crane time", span(row["unloading_s"])),
                ("", ", ".join(self.truck_words(lift["delivery"]))),
            ]
        if motion is not None:
            rows += [*self.hook(lift, 0), *self.hook(lift, -1)]
        return rows

    def card(self, lift: dict[str, Any]) -> tuple[list[Row], list[str]]:
        """The card of a lift: its rows, and its sentences."""
        rows, said = self.part_rows(lift), [lift["name"] or lift["global_id"]]
        words = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", lift["ifc_class"].removeprefix("Ifc")).lower().capitalize()
        said.append(f"{words}, lift {lift['number']} of {len(self.lifts)}")
        by = "" if lift["needed_by_s"] is None else f", by {when(lift, 'needed_by', 'needed_by_s')}"
        if lift["status"] == "planned":
            rows += self.lift_rows(lift)
            said.append(self._proof(lift))
        elif lift["status"] == "infeasible":
            said.append(sentence(lift["reason"] or ""))
            if lift["by_other_means"]:
                said.append(
                    f"It is needed after all earlier parts of the sequence{by}; "
                    "what rests on it is proven with it in place."
                )
            names = {part.id: part.name or part.global_id for part in self.site.components}
            said += [names.get(one, one) for one in lift["blocked_by"]]
        else:
            said.append(f"{sentence(lift['reason'])}. It is needed after all earlier parts of the sequence{by}.")
            if lift["carries_s"] is not None:
                begins, ends, carries = (lift[f"{key}_in_words"] for key in ("begins", "ends", "carries"))
                said.append(f"The work begins {begins} and ends {ends}; it carries what rests on it from {carries}.")
        for remark in self.remarks:
            if remark["component"] == lift["component"]:
                kind = "Note" if remark["severity"] == "note" else f"Remark, {remark['severity']}"
                said.append(f"{kind}: {remark['text']}")
        if lift["start_s"] is not None:
            said.append(f"Go to this lift, {when(lift, 'begins', 'start_s')}")
        if lift["order"] in self.motions:
            said.append(f"{percent(self.governing(lift)['share'])} of the capacity used")
        return rows, said

    def _proof(self, lift: dict[str, Any]) -> str:
        checks = sum(check["samples"] > 0 for check in self.verified["checks"].values())
        about = [one for one in self.remarks if one["component"] == lift["component"] and one["severity"] != "note"]
        count = len(lift["samples"]["time_s"]) if lift["order"] in self.motions else 0
        samples = f", {counted(count, 'sample')} of its motion" if count else ""
        return f"{'' if about else '✓ '}Proven: {checks} checks of the log passed for this lift{samples}."

    def list_row(self, lift: dict[str, Any]) -> list[str]:
        """Number, utilisation and time in the list."""
        motion = lift["order"] in self.motions
        if lift["status"] == "infeasible":
            return [str(lift["number"]), "", "✕"]
        use = percent(self.governing(lift)["share"]) if motion else "–"
        return [str(lift["number"]), use, "–" if lift["start_s"] is None else short_clock(lift["duration_s"])]

    def bar(self, lift: dict[str, Any]) -> str:
        """The title of a lift's bar."""
        words = [f"Lift {lift['number']}: {lift['name'] or lift['global_id']}", self.parts[lift["component"]].storey]
        words.append(f"{when(lift, 'begins', 'start_s')}, {span(lift['duration_s'])}")
        if lift["order"] in self.motions:
            share = self.governing(lift)["share"]
            critical = ", critical" if share >= self.site.rules.critical_share else ""
            words.append(f"{percent(share)} of the capacity{critical}")
        return "\n".join(filter(None, words))

    @cached_property
    def plan_rows(self) -> list[Row]:
        """The rows of the whole plan."""
        site, verified = self.site, self.verified
        bad = sum(lift["status"] == "infeasible" for lift in self.lifts)
        told = self.json["time"]
        lifted = [lift for lift in self.lifts if lift["status"] == "planned"]
        rows = [
            ("Model", str(site.source.get("name", ""))),
            ("Log", self.log.name),
            ("Planned", f"{len(lifted)} of {counted(len(self.lifts), 'lift')}"),
            ("Infeasible", str(bad)),
            ("Time", told["span_in_words"] if told else "no crane: nominal times, 1 s per move"),
            ("Work", told["hours_in_words"] if told else ""),
        ]
        if len(verified["cranes"]) < 2:
            rows += [("Crane", crane.name) for crane in site.cranes]
        else:
            rows += [(f"Crane {crane.name}", self._busy(n)) for n, crane in enumerate(site.cranes)]
        rows += [
            (f"Override, {crane['name']}", f"{one['key']}: {one['site']} instead of {one['catalogue']}")
            for crane in verified["cranes"]
            for one in crane["overrides"]
        ]
        for chart in self.charts:
            name = f"Empty hook, {chart['crane']}" if len(self.charts) > 1 else "Empty hook"
            empty_kg = chart["hook_block_kg"] + chart["rigging_mass_kg"]
            rows.append((name, f"{tonnes(empty_kg)}: hook block and rigging"))
        methods: dict[str, int] = {}
        names = {"policy": "policy", "retrained": "policy, retrained", "search": "search (A*)"}
        for lift in lifted:
            said = names.get(lift["method"], lift["method"])
            methods[said] = methods.get(said, 0) + 1
        frame = self.json["frame"]
        rows += [
            ("Mass lifted", tonnes(sum(lift["mass_kg"] for lift in lifted))),
            ("Found by", ", ".join(f"{name} {count}" for name, count in methods.items())),
            ("Cells", f"{' × '.join(map(str, frame['shape']))} of {fixed(frame['voxel_size_m'], self.digits)} m"),
        ]
        return rows

    def _busy(self, crane: int) -> str:
        own = [motion for motion in self.motions.values() if motion.get("crane", 0) == crane]
        busy = sum(p["end_ns"] - p["start_ns"] for motion in own for p in motion["phases"] if p["name"] != "wait") * S
        return f"{counted(len(own), 'lift')}, busy {percent(busy / (self.ends_s - self.begins_s))}"

    @cached_property
    def check_rows(self) -> list[list[str]]:
        """The table of the checks: its samples and worst values."""

        def worst(value: float | None) -> str:
            if value is None:
                return ""
            if value != 0 and abs(value) < 0.001:
                mantissa, power = f"{value:.1e}".split("e")
                return f"{mantissa}e{int(power):+d}"
            return fixed(value, 3)

        return [
            [name.replace("_", " "), f"{check['samples']:,}", worst(check["worst"])]
            for name, check in self.verified["checks"].items()
        ]

    @cached_property
    def rings(self) -> list[str]:
        """The labels of the cranes' rings that a page may show: each radius of a load chart with its capacity."""
        found = []
        for crane, chart in zip(self.site.cranes, self.charts, strict=True):
            pairs = zip(chart["radius_m"], chart["capacity_kg"], strict=True)
            found += [f"{metres(radius)}: {tonnes(kg)}" for radius, kg in pairs]
            found += [metres(crane.jib_length_m), metres(crane.min_radius_m)]
        return found
