"""Compares every number that the page of a log shows with the log.

    python tests/support/shown_numbers.py LOG ...

Not compared: a point that is picked in the view, which is one of the picture; what is drawn without words.
"""

from __future__ import annotations

import hashlib
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
from datetime import datetime, timedelta
from itertools import pairwise
from pathlib import Path
from typing import Any

from logged_numbers import Logged, Row
from number_words import clock, counted, date, fixed, metres
from seen_pages import Seen

STILL_M = 0.05

ROWS = """(panel) => [...document.querySelectorAll(`${panel} dl dt`)]
  .map((dt) => [dt.innerText, dt.nextElementSibling.innerText])"""
OPEN_REMARKS = """() => {
  window.page.details.open("remarks");
  for (const one of document.querySelectorAll("#panel-remarks details")) one.open = true;
}"""
SAID = """(panel) => [...document.querySelectorAll(`${panel} :is(h2, h3, p, li, summary, button, .meter)`)]
  .filter((one) => !one.closest("dl, .looks, table"))
  .filter((one) => !one.parentElement.closest("p, li, button"))
  .map((one) => one.matches(".meter") ? one.getAttribute("aria-label") : one.innerText)"""


class Differences:
    """What was compared, and what differs."""

    def __init__(self) -> None:
        self.numbers = 0
        self.found: list[str] = []

    def same(self, where: str, shown: Any, wanted: Any) -> None:
        self.numbers += len(re.findall(r"\d[\d,.:]*", str(wanted)))
        if shown != wanted:
            self.found.append(f"{where}: the page shows {shown!r}, the log has {wanted!r}")

    def rows(self, where: str, shown: list[Any], wanted: list[Row]) -> None:
        """Compare the rows that have a number; a row of one side only is a difference."""
        mine = [(label, words) for label, words in ((a, tidy(b)) for a, b in shown) if has_number(words)]
        log = [(label, words) for label, words in ((a, tidy(b)) for a, b in wanted) if has_number(words)]
        self.same(f"{where}, rows", [label for label, _ in mine], [label for label, _ in log])
        for (label, words), (_, told) in zip(mine, log, strict=False):
            self.same(f"{where}, {label}", words, told)

    def sentences(self, where: str, shown: list[str], wanted: list[str]) -> None:
        """Compare the sentences that have a number, in any order."""
        mine, log = (sorted(tidy(one) for one in side if has_number(one)) for side in (shown, wanted))
        self.same(where, mine, log)


def has_number(words: str) -> bool:
    return any(letter.isdigit() for letter in words)


def tidy(words: str) -> str:
    return " ".join(words.split())


def differences(seen: Seen, logged: Logged) -> Differences:
    """Compare all that an open page says with a log."""
    found = Differences()
    _header(seen, logged, found)
    _list(seen, logged, found)
    _cards(seen, logged, found)
    _plan(seen, logged, found)
    _remarks(seen, logged, found)
    if logged.planned:
        _time(seen, logged, found)
        _bars(seen, logged, found)
    _groups(seen, logged, found)
    _measured(seen, logged, found)
    return found


def _header(seen: Seen, logged: Logged, found: Differences) -> None:
    counts = [sum(lift["status"] == status for lift in logged.lifts) for status in ("planned", "infeasible")]
    told = logged.json["time"]
    time = f"{told['span_in_words']}, {told['hours_in_words']}" if told else "no crane"
    sha = hashlib.sha256(logged.log.read_bytes()).hexdigest()
    planned = f"{counted(counts[0], 'lift')} planned, {counts[1]} refused"
    facts = f"{planned} · {time} · log {logged.log.name}, SHA-256 {sha[:12]}…"
    found.same("header", seen.text("#facts"), facts)
    kinds = [remark["severity"] for remark in logged.remarks]
    count, serious = len(kinds) - kinds.count("note"), kinds.count("serious")
    words = counted(count, "remark") if count else counted(kinds.count("note"), "note") if kinds else "no remarks"
    words += f" ({serious} serious)" if serious else ""
    found.same("header, remarks", seen.text("#remarks-button").lstrip("⚠\ufe0e! "), words)


def _list(seen: Seen, logged: Logged, found: Differences) -> None:
    rows = """() => Object.fromEntries([...document.querySelectorAll("#list tbody tr")].map((row) =>
      [row.dataset.part, [1, 3, 4].map((n) => row.cells[n].innerText.trim())]))"""
    shown, ids = seen.page.evaluate(rows), [part.id for part in logged.site.components]
    found.same("list, count", seen.text("#count"), counted(len(logged.lifts), "part"))
    for lift in logged.lifts:
        cells = shown.get(str(ids.index(lift["component"])))
        found.same(f"list, lift {lift['number']}", cells, logged.list_row(lift))
    for key in ("mass", "utilisation", "duration"):
        seen.page.click(f'[data-sort="{key}"]')
        order = seen.page.eval_on_selector_all(
            "#list tbody tr td:nth-child(2)", "(cells) => cells.map((c) => +c.innerText)"
        )
        value = {
            "mass": lambda lift: lift["mass_kg"],
            "utilisation": lambda lift: logged.governing(lift)["share"] if lift["order"] in logged.motions else -1,
            "duration": lambda lift: lift["duration_s"] or -1,
        }[key]
        by_number = {lift["number"]: value(lift) for lift in logged.lifts}
        told = [by_number[number] for number in order]
        found.same(f"list by {key}", all(b <= a + 1e-9 for a, b in pairwise(told)), True)
    seen.page.click('[data-sort="order"]')
    name = logged.lifts[0]["name"] or logged.lifts[0]["global_id"]
    seen.page.fill("#search", name)
    words = name.lower().split()
    hits = sum(all(word in _searched(logged, lift) for word in words) for lift in logged.lifts)
    of = counted(len(logged.lifts), "part")
    found.same("search", seen.text("#count"), of if hits == len(logged.lifts) else f"{hits} of {of}")
    seen.page.fill("#search", "")


def _searched(logged: Logged, lift: dict[str, Any]) -> str:
    part = logged.parts[lift["component"]]
    split = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", lift["ifc_class"].removeprefix("Ifc"))
    texts = (
        lift["name"],
        lift["global_id"],
        part.id,
        lift["ifc_class"],
        split,
        part.type_name,
        part.storey,
        part.material,
    )
    return " ".join(filter(None, (*texts, lift["status"], lift["method"]))).lower()


def _cards(seen: Seen, logged: Logged, found: Differences) -> None:
    ids = [part.id for part in logged.site.components]
    for lift in logged.lifts:
        seen.page.evaluate(
            "(part) => { window.page.choose(part); window.page.details.open('part'); }", ids.index(lift["component"])
        )
        rows, said = logged.card(lift)
        where = f"card of lift {lift['number']}"
        found.rows(where, seen.page.evaluate(ROWS, "#panel-part"), rows)
        found.sentences(where, seen.page.evaluate(SAID, "#panel-part"), said)


def _plan(seen: Seen, logged: Logged, found: Differences) -> None:
    seen.page.evaluate("() => { window.page.choose(null); window.page.details.open('plan'); }")
    rows = [
        row for row in seen.page.evaluate(ROWS, "#panel-plan") if "SHA-256" not in row[0] and "digest" not in row[0]
    ]
    found.rows("plan", [row for row in rows if row[0] not in ("seed", "policy", "policy steps")], logged.plan_rows)
    shown = seen.page.eval_on_selector_all(
        "#panel-plan tbody tr", "(rows) => rows.map((row) => [0, 2, 3].map((n) => row.cells[n].innerText.trim()))"
    )
    for mine, log in zip(shown, logged.check_rows, strict=True):
        found.same(f"check {log[0]}", mine, log)
    hashes = dict(row for row in seen.page.evaluate(ROWS, "#panel-plan"))
    found.same("site digest", hashes["Site digest"], logged.json["site_digest"])
    found.same("seed", hashes.get("seed"), logged.json["metadata"].get("seed"))
    said = " ".join(seen.page.evaluate(SAID, "#panel-plan"))
    samples = sum(check["samples"] for check in logged.verified["checks"].values())
    looked = sum(check["samples"] > 0 for check in logged.verified["checks"].values())
    found.same("plan, proof", f"{counted(looked, 'check')}, {samples:,} samples" in tidy(said), True)
    for words in (*logged.verified["conditions"], *logged.json["notes"]):
        found.same(f"plan, {words!r}", tidy(words) in tidy(said), True)
    for clash in logged.json["clashes"]:
        depth = f"{fixed(clash['depth_m'] * 1000, 1)} mm"
        found.same(f"plan, overlap of {clash['first']}", depth in said, True)


def _remarks(seen: Seen, logged: Logged, found: Differences) -> None:
    seen.page.evaluate(OPEN_REMARKS)
    shown = seen.page.eval_on_selector_all("#panel-remarks li span", "(all) => all.map((one) => one.innerText)")
    found.sentences("remarks", shown, [remark["text"] for remark in logged.remarks])
    heads = seen.page.eval_on_selector_all(
        "#panel-remarks :is(h3, summary)", "(all) => all.map((one) => one.innerText)"
    )
    numbers = [int(match.group(1)) for head in heads if (match := re.search(r"\((\d+)\)$", head))]
    kinds: dict[tuple[str, str], int] = {}
    for remark in logged.remarks:
        for key in ((remark["severity"], ""), (remark["severity"], remark["kind"])):
            kinds[key] = kinds.get(key, 0) + 1
    found.same("remarks, counts", sorted(numbers), sorted(kinds.values()))


def _time(seen: Seen, logged: Logged, found: Differences) -> None:
    last = max(logged.planned, key=lambda lift: float(lift["start_s"] + lift["duration_s"]))
    ends = date(last["ends"]) if last["ends"] else last["ends_in_words"] or clock(logged.ends_s)
    found.same("timeline, end", seen.text("#total"), f"/ {ends}")
    for lift in logged.planned:
        middle = lift["start_s"] + lift["duration_s"] / 2
        if sum(one["start_s"] <= middle < one["start_s"] + one["duration_s"] for one in logged.planned) > 1:
            continue  # several cranes: which lift is told depends on their loads
        at = (lift["start_s"], "begins") if len(logged.site.cranes) < 2 else (middle, None)
        seen.page.evaluate("(at) => window.page.seek(at)", at[0])
        where = f"lift {lift['number']} under way"
        found.same(
            where,
            seen.text("#now strong"),
            f"Lift {lift['number']} of {len(logged.lifts)}: {lift['name'] or lift['global_id']}",
        )
        words = seen.text("#now span").split(" · ")
        found.same(where, seen.text("#clock"), words[0] if lift["begins_in_words"] else clock(at[0]))
        if lift["begins"]:
            since = timedelta(seconds=at[0] - lift["start_s"])
            found.same(f"{where}, date", words[0], date((datetime.fromisoformat(lift["begins"]) + since).isoformat()))
        elif lift["begins_in_words"] and at[1]:
            found.same(where, words[0], lift["begins_in_words"])
        _hook_at(seen, logged, lift, found)


def _hook_at(seen: Seen, logged: Logged, lift: dict[str, Any], found: Differences) -> None:
    """The hook that the page tells when the load is picked is that of the log within its tolerance."""
    if lift["order"] not in logged.motions or len(logged.site.cranes) > 1:
        return
    held, base = logged.held(lift), logged.site.cranes[0].base_m
    seen.page.evaluate("(at) => window.page.seek(at)", float(held["time_s"][-1]))
    seen.drawn()
    seen.page.evaluate("() => window.page._showNow()")
    told = [float(n) for n in re.findall(r"-?[\d.]+", seen.page.get_attribute("#now", "title").replace(",", " "))]
    slew, radius, height = (float(held[key][-1]) for key in ("slew_rad", "radius_m", "hook_height_m"))
    at = (base[0] + radius * math.cos(slew), base[1] + radius * math.sin(slew), height)
    off = max(abs(a - b) for a, b in zip(told, at, strict=True))
    found.same(f"lift {lift['number']}, hook within {STILL_M} m", off <= STILL_M, True)


def _bars(seen: Seen, logged: Logged, found: Differences) -> None:
    seen.page.evaluate("() => window.page.gantt.toggle(true)")
    read = """(kind) => [...document.querySelectorAll(`#gantt-chart button${kind}`)].map((bar) =>
      [Number(bar.dataset.part), bar.title, bar.textContent,
        ...["left", "width"].map((key) => parseFloat(bar.style[key]))])"""
    ids, whole = [part.id for part in logged.site.components], logged.ends_s - logged.begins_s
    shown = {row[0]: row[1:] for row in seen.page.evaluate(read, ":not(.truck-bar)")}
    found.same("timeline, bars", len(shown), len(logged.planned))
    for lift in logged.planned:
        title, text, left, width = shown[ids.index(lift["component"])]
        where = f"bar of lift {lift['number']}"
        found.same(where, tidy(title), tidy(logged.bar(lift)))
        found.same(where, text, str(lift["number"]))
        place = [100 * (lift["start_s"] - logged.begins_s) / whole, 100 * lift["duration_s"] / whole]
        found.same(
            f"{where}, place", [abs(a - b) < 1e-3 for a, b in zip((left, width), place, strict=True)], [True, True]
        )
    trucks = seen.page.evaluate(read, ".truck-bar")
    wanted = [(str(number + 1), words) for number in logged.trucks if (words := logged.truck_words(number))]
    found.same("deliveries", [(row[2], row[1].split("\n")) for row in trucks], wanted)
    rows = seen.page.eval_on_selector_all("#gantt-chart .row[role=group]", "(all) => all.map((one) => one.ariaLabel)")
    lifts = [int(match.group(1)) for row in rows if (match := re.search(r"(\d+) lifts?$", row))]
    found.same("timeline, lifts by row", sum(lifts), len(logged.planned))


def _groups(seen: Seen, logged: Logged, found: Differences) -> None:
    """The legend counts the parts of each group; the rings have radius and capacity."""
    for by in ("class", "storey", "delivery"):
        seen.page.evaluate("(by) => window.page.setColour(by)", by)
        words = seen.page.eval_on_selector_all("#legend button", "(all) => all.map((one) => one.innerText)")
        counts: dict[Any, int] = {}
        for lift in logged.lifts:
            part = logged.parts[lift["component"]]
            key = {"class": part.ifc_class or None, "storey": part.storey or None, "delivery": lift["delivery"]}[by]
            counts[key] = counts.get(key, 0) + 1
        numbers = sorted(int(match.group(1)) for one in words if (match := re.search(r"\((\d+)\)$", one.strip())))
        found.same(f"legend by {by}", numbers, sorted(counts.values()))
    seen.page.evaluate("() => window.page.setColour('status')")
    if logged.charts:
        labels = seen.page.evaluate("() => window.page._ringLabels().map(({ text }) => text)")
        found.same("rings", [label for label in labels if label not in logged.rings], [])
        found.numbers += len(labels)


def _measured(seen: Seen, logged: Logged, found: Differences) -> None:
    """The distance between the set points of the first and the last lift, typed."""
    lifts = [lift for lift in logged.planned if lift["order"] in logged.motions]
    if len(lifts) < 2:
        return
    points = [
        [float(n) for n in re.findall(r"-?[\d.]+", logged.hook(lift, -1)[0][1])] for lift in (lifts[0], lifts[-1])
    ]
    seen.page.evaluate("() => { document.getElementById('measure').open = true; }")
    for n, at in enumerate(points):
        for axis, value in zip("xyz", at, strict=True):
            field = seen.page.get_by_label(f"Point {n + 1}: {axis} in metres")
            field.fill(str(value))
            field.dispatch_event("change")
    apart = [b - a for a, b in zip(*points, strict=True)]
    words = ", ".join(f"{axis} {fixed(value, 2)}" for axis, value in zip("xyz", apart, strict=True))
    wanted = f"{metres(math.hypot(*apart))} ({words}; on plan {metres(math.hypot(*apart[:2]))})"
    found.same("measured", seen.text("#measure output"), wanted)
    seen.page.evaluate("() => { document.getElementById('measure').open = false; }")


def opened(browser: Any, page: Path, **context: Any) -> Seen:
    """Open a page file."""
    seen = Seen(
        browser.new_context(viewport={"width": 1280, "height": 720}, reduced_motion="reduce", **context).new_page()
    )
    seen.page.goto(page.as_uri())
    seen.wait("document.documentElement.dataset.drawn > 0")
    return seen


def main(logs: list[str]) -> int:
    """Print how many numbers were compared, and every difference; return 1 if there is one."""
    from playwright.sync_api import sync_playwright

    arguments = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    path = os.environ.get("BIMVOX_BROWSER") or shutil.which("chromium") or shutil.which("google-chrome")
    failed = False
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(executable_path=path, args=arguments)
        for log in logs:
            copy = Path(shutil.copy(log, folder))
            page = copy.with_suffix(".html")
            subprocess.run([sys.executable, "-m", "bimvox_cli", "render", copy, "-o", page, "-q"], check=True)
            found = differences(opened(browser, page), Logged(copy))
            failed = failed or bool(found.found)
            print(f"{log}: {found.numbers:,} numbers compared, {len(found.found)} differ")
            for line in found.found:
                print(f"  {line}")
        browser.close()
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
