"""The fleet report: every flight with its links, the same bytes for the same fleet, useful whatever it holds."""

import base64
import hashlib
import math
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pytest
from pypdf import PdfReader

from groundstation.base.timescales import utc_ns_to_stamp
from groundstation.chapters.fleet import flights
from groundstation.chapters.parts import Figure, Grid, Section
from groundstation.chapters.plots.fleet.trend import charts
from groundstation.methods.fleet import answer
from groundstation.methods.fleet.changes import ChangeSettings
from groundstation.methods.fleet.density import densities_of, histogram_of
from groundstation.methods.fleet.deviation import deviations
from groundstation.methods.fleet.moments import moments_of
from groundstation.methods.fleet.skill import SkillMergers
from groundstation.methods.fleet.trends import trends
from groundstation.pipeline.many_flights.fleet.columns import FLIGHT_COLUMNS
from groundstation.pipeline.many_flights.fleet.statistics import gather
from groundstation.plots.marks import Curve, Limit
from groundstation.reports.drawing import plot_of
from groundstation.reports.fleet_report import MOST_ROWS_ON_PAPER, PAGE, write_fleet_report
from groundstation.results.arrays.fleet import FleetChecks, FleetSkillFlights
from groundstation.results.figures import FigureData
from groundstation.results.fleet import FleetResults, NotInFleet
from groundstation.results.fleet_share import SkillOfFlight
from groundstation.results.fleet_units import UnitLimits
from groundstation.systems import systems
from groundstation.systems.heading import fleet_densities_plots as densities
from tests.browser import Browser
from tests.fleet_example import DAY_NS, START_NS, flights_table, save_flight, skill
from tests.reports.test_reports import HOSTILE, Page
from tests.test_fleet_statistics import EMPTY

FILES = (("report", "report", "html"), ("recording", "", "rrd"), ("mcap", "", "mcap"))
MISSING = (NotInFleet("failed", "day 2/b.csv", "no time column"), NotInFleet("skipped", "notes.txt", "no reader"))
HORIZONS_MIN = (1.0, 5.0, 10.0, 30.0, 60.0, 120.0)


def fleet_of(
    count: int,
    names: Sequence[str] = ("A12", "101", "RA-1"),
    *,
    samples: int = 200,
    step_deg: float = 0.8,
    not_in_fleet: Sequence[NotInFleet] = (),
    limits: UnitLimits | None = None,
    **changes: Any,
) -> FleetResults:
    """A fleet as the pipeline would gather it: flights in turn by aircraft, the first of which changes half-way.

    ``changes`` are columns of the flights.
    """
    rng = np.random.default_rng([count, len(names)])
    owner = [names[number % len(names)] for number in range(count)]
    level = {name: rng.normal(0.5, 0.3) for name in names}
    is_late = np.arange(count) >= count // 2
    truth = np.array([level[name] + rng.normal(0.0, 0.12) for name in owner])
    truth += np.where(is_late & (np.array(owner) == names[0]), step_deg, 0.0) if count else 0.0
    values = [truth[row] + rng.normal(0.0, 0.4, samples) for row in range(count)]
    moments = [moments_of(own) for own in values]
    start = START_NS + DAY_NS * np.arange(count)
    ids = [f"{utc_ns_to_stamp(ns)}_{row}" for row, ns in enumerate(start.tolist())]
    rate = np.exp(rng.normal(0.0, 0.3, count))
    given: dict[str, Any] = {
        "flight_id": ids,
        "aircraft": owner,
        "start_utc": start.tolist(),
        "status": ["ok"] * count,
        "verdict": ["reject" if row % 17 == 9 else "accept" for row in range(count)],
        "verdict_reason": ["precision e 0.081 deg above 0.05 deg" if row % 17 == 9 else "" for row in range(count)],
        "error_deg": truth.tolist(),
        "standard_error_deg": [0.03] * count,
        "confidence95_low_deg": (truth - 0.06).tolist(),
        "confidence95_high_deg": (truth + 0.06).tolist(),
        "correction_deg": (-np.round(truth, 2)).tolist(),
        "estimate_sd_deg": rng.uniform(0.3, 0.5, count).tolist(),
        "samples": [float(part.count) for part in moments],
        "sample_mean_deg": [part.mean for part in moments],
        "sample_m2_deg2": [part.m2 for part in moments],
        "reference_residual_arcmin": rng.normal(0.0, 3.0, count).tolist(),
        "ins_kind": ["unaided"] * count,
        "radial_error_rate_fit_nmiph": rate.tolist(),
        "radial_error_rate_50_nmiph": rate.tolist(),
        "radial_error_rate_95_nmiph": (2.0 * rate).tolist(),
        "forecast_60min_rms_m": (900.0 * rate).tolist(),
        "findings_fail": [0.0] * count,
        **{name: [f"{own}/{file or own}.{end}" for own in ids] for name, file, end in FILES},
    } | changes
    flights = flights_table({one.name: given.get(one.name, [EMPTY[one.kind]] * count) for one in FLIGHT_COLUMNS})
    settings = ChangeSettings()
    trend = trends(flights, settings, limits)
    skill, skill_flights = skill_of(flights, rate)
    checks = checks_of(flights, rng)
    return FleetResults(
        flights,
        densities_of(ids, owner, moments, [histogram_of(own) for own in values]),
        answer.normals_of(owner, moments),
        answer.by_aircraft(flights),
        trend.charts,
        trend.changes,
        skill.whole.rows(),
        skill_flights,
        answer.calibrations(checks),
        checks,
        answer.outliers(flights),
        tuple(not_in_fleet),
        answer.stated_rates(settings),
        deviations(flights),
        slopes=trend.slopes,
        skill_by_aircraft=skill.by_aircraft(),
    )


def skill_of(flights: FigureData, rate: Any) -> tuple[SkillMergers, FleetSkillFlights]:
    mergers, rows = SkillMergers(), []
    owner = flights["aircraft"].tolist()
    for place, own in enumerate(rate.tolist()):
        for method, factor in (("raw_ins", 1.6), ("hold_velocity", 1.2), ("last_estimate", 1.0)):
            for horizon in HORIZONS_MIN:
                coverage = math.nan if method == "raw_ins" else 0.93
                one = SkillOfFlight(method, horizon, 10, factor * own * 15.0 * horizon, coverage)
                mergers.add(one, owner[place])
                if method == "last_estimate":
                    rows.append((place, one))
    names = ("flight_id", "aircraft", "start_utc")
    columns = {name: flights[name][np.array([place for place, _ in rows], dtype=np.intp)] for name in names}
    for name in ("method", "horizon_min", "starts", "rms_m", "coverage95"):
        columns[name] = np.array([getattr(one, name) for _, one in rows], dtype="U20" if name == "method" else "f8")
    return mergers, FleetSkillFlights(**columns)


def checks_of(flights: FigureData, rng: Any) -> FleetChecks:
    count = len(flights)
    quantity = np.repeat(np.array(["reference", "onboard"]), count)
    z = np.concatenate([rng.normal(0.0, 1.5, count), rng.normal(0.0, 0.6, count)])
    columns = {name: np.tile(flights[name], 2) for name in ("flight_id", "aircraft", "verdict")}
    columns |= {"quantity": quantity, "z": z, "is_inside": np.abs(z) < 1.96}
    columns |= {"residual_deg": 0.05 * z, "sigma_deg": np.full(2 * count, 0.05)}
    return FleetChecks(**columns)


def page_of(out: Path, fleet: FleetResults) -> Page:
    written = write_fleet_report(out, fleet, systems(), with_pdf=False)
    assert written.paths == (out / PAGE,)
    return Page((out / PAGE).read_text(encoding="utf-8"))


def as_read(page: Page) -> str:
    """The text of a page, no blank before a comma or a full stop."""
    return re.sub(" +(?=[.,])", "", page.text)


def page_and_paper_of(out: Path, fleet: FleetResults) -> tuple[Page, str]:
    written = write_fleet_report(out, fleet, systems(), with_pdf=True)
    assert not written.problem
    paper = " ".join(" ".join(page.extract_text() for page in PdfReader(written.paths[1]).pages).split())
    return Page((out / PAGE).read_text(encoding="utf-8")), paper


def cells(html: str) -> list[list[str]]:
    """Texts of the table of flights, row by row."""
    body = html.split('id="flights-table"')[1].split("<tbody>")[1].split("</tbody>")[0]
    rows = re.findall(r"<tr>(.*?)</tr>", body, re.DOTALL)
    return [
        [re.sub("<[^>]*>", "", cell).strip() for cell in re.findall("<td[^>]*>(.*?)</td>", row, re.S)] for row in rows
    ]


@pytest.fixture(scope="module")
def usual() -> FleetResults:
    """Sixty flights of three aircraft, the first of which changes half-way."""
    return fleet_of(60, not_in_fleet=MISSING)


@pytest.fixture(scope="module")
def html(usual: FleetResults, tmp_path_factory: pytest.TempPathFactory) -> str:
    out = tmp_path_factory.mktemp("fleet")
    page_of(out, usual)
    return (out / PAGE).read_text(encoding="utf-8")


def test_the_table_of_a_large_fleet_has_what_is_of_note_and_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    fleet = fleet_of(40)
    noted = {name for name, marks in flights.remarks_of(fleet).items() if any(one.tone != "plain" for one in marks)}
    assert 0 < len(noted) < 12 and len(flights.lines(fleet)) == 40 and flights.caption_of(fleet) == flights.CAPTION
    monkeypatch.setattr(flights, "MOST_LINES", 12)
    names = [line.cells[0] for line in flights.lines(fleet)]
    assert len(names) == 12 and noted <= set(names) and names == sorted(names)
    others = [name for name in fleet.flights["flight_id"].tolist() if name not in noted]
    assert set(names) - noted == set(others[len(noted) - 12 :])
    assert "12 of 40 flights: notable ones first" in flights.caption_of(fleet)


def test_every_flight_has_a_row_with_its_figures(usual: FleetResults, html: str) -> None:
    rows = cells(html)
    assert [row[0] for row in rows] == usual.flights["flight_id"].tolist()
    errors = [float(row[4].replace("−", "-")) for row in rows]
    assert errors == pytest.approx(usual.flights["error_deg"], abs=6e-4)
    assert [row[5] for row in rows] == ["0.060"] * 60
    assert sum(row[3] == "✗ reject" for row in rows) == int(np.sum(usual.flights["verdict"] == "reject")) > 0
    assert "rejected (reason 1)" in rows[9][10] and html.count("precision e 0.081° above 0.05°") == 1


def test_the_page_holds_what_the_results_say(usual: FleetResults, html: str) -> None:
    text = Page(html).text
    assert len(usual.change_points) == 1
    (change,) = usual.change_points
    assert "fitted to them" not in text and "Whole fleet" not in text  # no mean over different aircraft
    assert f"A12: heading error {change.level_before:+.3f}° before" in text and change.flight_id in text
    assert "60 flights of 3 aircraft" in text and "day 2/b.csv no time column" in text
    low, high = usual.by_aircraft[1].confidence95_deg or (0.0, 0.0)
    assert f"{low:+.3f}° … {high:+.3f}°".replace("-", "−") in text
    reference = usual.calibration[0]
    assert f"{reference.inside} of {reference.checks}" in text and "▲ too sure" in text
    at_60 = next(row for row in usual.skill if (row.method, row.horizon_min) == ("last_estimate", 60.0))
    assert f"RMS over {at_60.starts} starts" in text and tiles_of(usual)["Forecast, 60 min"][1].startswith("3 aircraft")


def test_a_slope_is_told_on_top_with_its_date(tmp_path: Path) -> None:
    drift = 0.08 * np.arange(20) + np.random.default_rng(5).normal(0.0, 0.05, 20)
    fleet = fleet_of(20, ("A12",), samples=20, limits=UnitLimits(heading_error_deg=3.0), error_deg=drift.tolist())
    (slope,) = (one for one in fleet.slopes if one.quantity == "error_deg")
    text = page_of(tmp_path, fleet).text
    due = np.datetime64(slope.due_utc_ns, "ns").astype("datetime64[D]")
    assert slope.is_slope and "1 slope" in text and f"reaches 3.000° on {due} (95 %" in text
    assert (
        f"A12: heading error rises by {slope.slope_per_flight:+.4f}° a flight" in text
        and "over 20 flights since 2026-05-04" in text
    )


def test_what_asks_for_a_look_is_on_the_first_screen(tmp_path: Path) -> None:
    count = 6
    fleet = fleet_of(
        count,
        ("A12",),
        samples=20,
        verdict=["reject", *["accept"] * 5],
        landing_approaches=[2.0, 1.0, *[math.nan] * 4],
        landing_unstable_approaches=[1.0, 0.0, *[math.nan] * 4],
        landing_criteria_not_met=["speed sink_rate", *[""] * 5],
        has_lost_data=[False, True, *[False] * 4],
        health_verdict=["", "", "fail", "pass", "warn", ""],
        health_sentence=["", "", "vibration high", "", "", ""],
        duration_s=[3725.0] * count,
        trajectory_state=["accepted"] * count,
        source=["a.ulg"] * count,
    )
    page = page_of(tmp_path, fleet)
    ids = fleet.flights["flight_id"].tolist()
    first = as_read(page).split("Every flight of the fleet")[0]
    assert f"Rejected: {ids[0]}." in first and f"Approach not stabilised: {ids[0]}." in first
    assert f"Data lost: {ids[1]}." in first and f"Health bad: {ids[2]}." in first
    assert "1 rejected · 1 approach not stabilised · 1 flight with bad health · 1 flight with lost data" in first
    heads = [one.title for one in flights.heads_of(fleet)]
    assert heads[-5:] == ["Duration", "Approaches", "Health", "Trajectory", "Remarks"]
    rows = cells((tmp_path / PAGE).read_text(encoding="utf-8"))
    assert rows[0][10:14] == ["1:02:05", "▲ 2 (1)", "—", "✓ accept"] and "a.ulg" in rows[0][15]
    assert "1 approach not stabilised (last: speed, sink rate)" in rows[0][14] and "vibration high" in rows[2][14]
    bare = fleet_of(3, ("A12",), samples=20, error_deg=[math.nan] * 3)
    assert "Error, °" not in [one.title for one in flights.heads_of(bare)]


def tiles_of(fleet: FleetResults) -> dict[str, tuple[str, str]]:
    """The key figures of all chapters: value and remark by label."""
    every = (figure for chapter in systems().fleet_chapters for figure in chapter.figures(fleet))
    return {label: (value.replace("\u202f", " "), remark) for label, value, remark in every}


def test_tiles_never_average_aircraft() -> None:
    rate = [1.0, 4.0] * 4
    two = fleet_of(8, ("A12", "RA-1"), samples=20, radial_error_rate_fit_nmiph=rate)
    shown, table = tiles_of(two), two.skill_flights
    assert shown["INS drift"] == ("1.00 … 4.00 nmi/h", "medians of 2 aircraft, 8 unaided flights")
    value, remark = shown["Forecast, 60 min"]
    own = [
        math.sqrt(np.mean(table.rms_m[(table.aircraft == name) & (table.horizon_min == 60.0)] ** 2))
        for name in ("A12", "RA-1")
    ]
    assert value == f"{min(own):.0f} … {max(own):.0f} m" and remark.startswith("2 aircraft; RMS over")
    shown = tiles_of(fleet_of(8, ("A12",), samples=20, radial_error_rate_fit_nmiph=rate))
    assert shown["INS drift"] == ("2.50 nmi/h", "median of 8 unaided flights")
    assert "…" not in shown["Forecast, 60 min"][0]


def test_the_forecast_and_the_density_are_told_of_each_aircraft(tmp_path: Path) -> None:
    several = fleet_of(12, ("A12", "RA-1", ""), samples=20)
    flown = several.skill_flights
    at_60 = {name: flown.rms_m[(flown.aircraft == name) & (flown.horizon_min == 60.0)] for name in ("A12", "RA-1")}
    expected = {name: float(np.sqrt(np.mean(rms**2))) for name, rms in at_60.items()}
    assert abs(expected["A12"] - expected["RA-1"]) > 1.0
    told = section_of(several, "forecast")
    table = next(one for one in told.parts if isinstance(one, Grid) and one.title.startswith("RMS radial"))
    at = [head.title for head in table.heads].index("60 min")
    shipped = {row[0]: row[at] for row in table.rows if "(shipped)" in str(row[1])}
    assert {name: float(str(value).replace("\u202f", "")) for name, value in shipped.items()} == pytest.approx(
        expected, abs=0.5
    )
    assert {row[0] for row in table.rows} == {"A12", "RA-1"} and len(table.rows) == 2 * 3
    assert "never merged" in told.lead and "4 flights name none" in told.lead
    growth = plot_of(systems().fleet_plots, Figure("fleet.growth"), several)
    assert growth is not None
    curves = {one.name: one for one in growth.panels[0].marks if isinstance(one, Curve)}
    assert list(curves) == ["A12", "RA-1"]
    assert {name: float(one.y[one.x == 60.0][0]) for name, one in curves.items()} == pytest.approx(expected)
    overlay = densities.overlay(several)
    dashed = {one.name: one for one in overlay.panels[0].marks if isinstance(one, Curve) and one.dash == "dashed"}
    assert list(dashed) == ["A12", "RA-1"] and "never merged" in section_of(several, "densities").lead
    one, own = several.densities, several.densities.aircraft == "RA-1"
    width = float(np.diff(one.edge_deg)[0])
    assert one.pooled_of("RA-1").sum() * width == pytest.approx(1.0, abs=1e-5)
    assert one.pooled_of("RA-1") == pytest.approx(one.density_per_deg[own].mean(axis=0), abs=1e-6)
    page = page_of(tmp_path, several).text
    assert "all samples" not in page and "over all starts of all flights" not in page


def test_one_aircraft_is_named_in_a_sentence() -> None:
    for key in ("forecast", "densities"):
        assert "All are of A12." in section_of(fleet_of(4, ("A12",), samples=20), key).lead
        assert "All are of" not in section_of(fleet_of(4, ("",), samples=20), key).lead
    assert "The logs name no aircraft" in section_of(fleet_of(4, ("",), samples=20), "forecast").lead
    mixed = section_of(fleet_of(4, ("A12", ""), samples=20), "forecast").lead
    assert "All are of A12; 2 flights whose log names none count as its own." in mixed
    many = section_of(fleet_of(40, [f"R{number}" for number in range(20)], samples=20), "forecast")
    table = next(one for one in many.parts if isinstance(one, Grid) and one.title.startswith("RMS radial"))
    assert len(table.rows) == 2 * 20 and "the raw INS and the shipped method" in table.caption


def section_of(fleet: FleetResults, key: str) -> Section:
    """A chapter of the fleet by its anchor."""
    return next(one for chapter in systems().fleet_chapters if (one := chapter.build(fleet)) and one.key == key)


def test_a_reason_is_told_once_with_its_flights(tmp_path: Path) -> None:
    why = [f"GNSS shows {speed} m/s at standstill, at most 0.01 m/s" for speed in (0.04, 0.05)]
    fleet = fleet_of(
        6, ("A12",), samples=20, verdict=["reject"] * 5 + ["accept"], verdict_reason=why * 2 + ["short", ""]
    )
    text, ids = as_read(page_of(tmp_path, fleet)), fleet.flights["flight_id"].tolist()
    assert text.count("at standstill, at most") == 1 and f"4 flights: {', '.join(ids[:4])}" in text
    remarks = flights.remarks_of(fleet)
    assert [remarks[one][0].text for one in ids[:5]] == ["rejected (reason 1)"] * 4 + ["rejected: short"]
    assert f'<span class="id">{ids[0]}</span>' in (tmp_path / PAGE).read_text(encoding="utf-8"), "kept on a line"


def test_charts_of_health_have_the_limit_of_the_check(tmp_path: Path) -> None:
    hdop = (0.8 + 0.01 * np.arange(12)).tolist()
    fleet = fleet_of(12, ("A12",), samples=20, health_hdop=hdop, health_hdop_limit=[2.0] * 12)
    drawn = charts(fleet, "health_hdop")
    assert drawn is not None and "Dotted red" in drawn.caption
    marks = drawn.rows[0].panels[0].marks
    assert [mark.value for mark in marks if isinstance(mark, Limit) and not mark.is_upright] == [2.0]
    assert {one.limit for one in fleet.slopes if one.quantity == "health_hdop"} == {2.0}
    far = charts(fleet_of(12, ("A12",), samples=20, health_hdop=hdop, health_hdop_limit=[20.0] * 12), "health_hdop")
    bare = charts(fleet_of(12, ("A12",), samples=20, health_hdop=hdop), "health_hdop")
    for other in (far, bare):
        assert other is not None
        assert not [one for one in other.rows[0].panels[0].marks if isinstance(one, Limit) and not one.is_upright]
    assert bare is not None and "Dotted red" not in bare.caption


def test_only_the_script_of_the_report_may_run(html: str) -> None:
    page = Page(html)
    (script,) = re.findall(r"<script>(.*?)</script>", html, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = next(value for tag, name, value in page.attributes if tag == "meta" and name == "content")
    assert policy.startswith("default-src 'none'") and policy.endswith(f"script-src 'sha256-{digest}'")
    assert page.tags.count("script") == 1 and not [name for _, name, _ in page.attributes if name.startswith("on")]
    names = [value for _, name, value in page.attributes if name == "id"]
    assert len(names) == len(set(names))
    inside = [value[1:] for _, name, value in page.attributes if name in ("href", "xlink:href") and value[:1] == "#"]
    assert set(inside) <= set(names)


def test_links_lead_to_files_beside_the_page(tmp_path: Path) -> None:
    for number in range(2):
        (save_flight(tmp_path, number) / "report.html").write_text("")
    next(tmp_path.glob("*_1")).rename(tmp_path / "a b#c?d%41&javascript:")
    page = page_of(tmp_path, gather(tmp_path))
    links = [value for tag, name, value in page.attributes if tag == "a" and name == "href" and value[:1] != "#"]
    found = [link for link in links if link not in ("fleet.parquet", "index.csv")]
    assert len(found) == 4 and all((tmp_path / unquote(link)).exists() for link in found)
    assert not [link for link in links if re.match("[a-z]+:|/", link)]


def test_nothing_from_a_log_is_markup(tmp_path: Path) -> None:
    names = (HOSTILE, "=1+1", "x" * 500, "Як-130 №7")
    fleet = fleet_of(8, names, samples=20, not_in_fleet=(NotInFleet("failed", HOSTILE, HOSTILE * 20),))
    columns = dict(fleet.flights.columns) | {"verdict_reason": np.full(8, HOSTILE), "report": np.full(8, HOSTILE)}
    fleet = replace(fleet, flights=FigureData("flights", columns, {}))
    page, paper = page_and_paper_of(tmp_path, fleet)
    assert page.tags.count("script") == 1 and "img" not in page.tags
    assert HOSTILE in page.text and "{{7*7}}" in page.text
    assert "alert(1)" in paper


@pytest.mark.slow
def test_the_same_fleet_gives_the_same_bytes_wherever_it_is_made(tmp_path: Path) -> None:
    fleet = fleet_of(12, samples=50, not_in_fleet=MISSING)
    first = [path.read_bytes() for path in write_fleet_report(tmp_path, fleet, systems(), with_pdf=True).paths]
    code = (
        "import sys; from pathlib import Path; from tests.reports.test_fleet_report import *;"
        "fleet = fleet_of(12, samples=50, not_in_fleet=MISSING);"
        "write_fleet_report(Path(sys.argv[1]), fleet, systems(), with_pdf=True)"
    )
    (tmp_path / "again").mkdir()
    environment = os.environ | {"TZ": "Asia/Tokyo", "PYTHONHASHSEED": "7", "LC_ALL": "C"}
    command = [sys.executable, "-c", code, str(tmp_path / "again")]
    subprocess.run(command, env=environment, check=True, cwd=Path(__file__).parents[2])
    assert [path.read_bytes() for path in sorted((tmp_path / "again").iterdir())] == first


ODD: dict[str, Any] = {
    "none": lambda: fleet_of(0),
    "failed alone": lambda: fleet_of(0, not_in_fleet=MISSING[:1]),
    "one": lambda: fleet_of(1),
    "one sample": lambda: fleet_of(1, samples=1),
    "unnamed": lambda: fleet_of(30, ("",)),
    "named and not": lambda: fleet_of(30, ("A12", "RA-1", "")),
    "one named and not": lambda: fleet_of(30, ("A12", "")),
    "timeless": lambda: fleet_of(30, start_utc=[None] * 30),
    "one time": lambda: fleet_of(30, start_utc=[START_NS] * 30),
    "no error": lambda: fleet_of(30, error_deg=[math.nan] * 30, verdict=[""] * 30),
    "absurd": lambda: fleet_of(30, error_deg=[1e15, -1e15] * 15, radial_error_rate_fit_nmiph=[1e-300, 1e15] * 15),
    "aided": lambda: fleet_of(30, radial_error_rate_fit_nmiph=[0.0] * 30, ins_kind=["gnss_aided"] * 30),
    "all failed": lambda: fleet_of(30, status=["failed"] * 30, samples=2),
    "forty aircraft": lambda: fleet_of(80, [f"R{number}" for number in range(40)], samples=5),
}


ON_PAPER = ("none", "one sample", "absurd")  # of the others the page alone


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=pytest.mark.slow) if one in ("aided", "forty aircraft") else one for one in ODD]
)
def test_every_fleet_gets_its_report(tmp_path: Path, name: str) -> None:
    fleet = ODD[name]()
    page, paper = page_and_paper_of(tmp_path, fleet) if name in ON_PAPER else (page_of(tmp_path, fleet), "")
    assert not {"nan", "inf", "nat"} & {word for text in page.texts for word in re.split(r"[^a-z]+", text.lower())}
    if len(fleet):
        assert len(cells((tmp_path / PAGE).read_text(encoding="utf-8"))) == len(fleet)
    if paper:
        assert ("No flights" if not len(fleet) else f"{len(fleet)} flight") in paper
        assert "How it was computed" in paper


def test_paper_lists_what_is_of_note_and_says_how_many_more(tmp_path: Path) -> None:
    missing = [NotInFleet("failed", f"log-{number:03d}.csv", "empty") for number in range(MOST_ROWS_ON_PAPER + 40)]
    fleet = fleet_of(200, not_in_fleet=missing, samples=20, findings_fail=[0.0] * 199 + [2.0])
    _, paper = page_and_paper_of(tmp_path, fleet)
    shown = set(re.findall(r"log-\d{3}\.csv", paper))
    assert len(shown) == MOST_ROWS_ON_PAPER and "The first 60; 40 more in summary.html." in paper
    rejected = fleet.flights["flight_id"][fleet.flights["verdict"] == "reject"].tolist()
    quiet = fleet.flights["flight_id"][150]
    assert all(flight_id in paper for flight_id in rejected) and quiet not in paper and "2 severe findings" in paper
    assert quiet in (tmp_path / PAGE).read_text(encoding="utf-8")


def test_many_flights_become_bands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fleet = fleet_of(40, ("A12",))
    assert "A thin line for each of 40 flights" in page_of(tmp_path, fleet).text
    lines = (tmp_path / PAGE).stat().st_size
    monkeypatch.setattr(densities, "MOST_LINES", 39)
    assert "the middle 90 % and 50 % of them" in page_of(tmp_path, fleet).text
    assert (tmp_path / PAGE).stat().st_size < lines


@pytest.mark.slow
def test_ten_thousand_flights_stay_usable(tmp_path: Path) -> None:
    """Measured: 3.5 s and 6.9 MB with forty aircraft; the limit here is of size and rows alone, machines differ."""
    fleet = fleet_of(10_000, [f"A{number}" for number in range(40)], samples=40)
    page_of(tmp_path, fleet)
    html = (tmp_path / PAGE).read_text(encoding="utf-8")
    assert len(html.encode()) < 10_000_000 and html.count("<tr>") > 10_000


def test_flights_that_are_far_from_all_others_are_counted_beyond_the_axis(tmp_path: Path) -> None:
    for number in range(12):
        save_flight(tmp_path, number, error_deg=1.0, samples=200, forecast=skill() if number < 3 else None)
    save_flight(tmp_path, 30, error_deg=80.0, samples=3)
    assert "1 flight lies mostly beyond the axis." in page_of(tmp_path, gather(tmp_path)).text


def test_the_table_sorts_by_number_and_missing_stays_last(tmp_path: Path, chromium: Browser) -> None:
    page_of(tmp_path, fleet_of(6, samples=5, error_deg=[-0.5, 10.0, math.nan, 9.0, -12.0, 0.0]))
    chromium.open(tmp_path / PAGE)
    for expected in ("−12.000 −0.500 0.000 +9.000 +10.000 —", "+10.000 +9.000 0.000 −0.500 −12.000 —"):
        chromium.run("document.querySelectorAll('#flights-table button')[4].click()")
        shown = chromium.run("document.documentElement.outerHTML")
        assert [row[4] for row in cells(shown)] == expected.split()


def test_every_table_sorts(tmp_path: Path, chromium: Browser) -> None:
    page_of(tmp_path, fleet_of(60, not_in_fleet=MISSING))
    chromium.open(tmp_path / PAGE)
    table = "Array.from(document.querySelectorAll('#aircraft table'))[0]"
    for sign in (1, -1):
        chromium.run(f"{table}.querySelectorAll('button')[4].click()")
        shown = chromium.run(f"Array.from({table}.tBodies[0].rows).map(row => row.cells[4].textContent)")
        values = [sign * float(text.replace("−", "-")) for text in shown]
        assert len(values) == 3 and values == sorted(values)
    assert chromium.run(f"{table}.querySelectorAll('th')[4].getAttribute('aria-sort')") == "descending"
    assert not chromium.complaints()


def test_without_typst_the_page_is_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "summary.pdf").write_bytes(b"old")
    monkeypatch.setitem(sys.modules, "typst", None)
    written = write_fleet_report(tmp_path, fleet_of(1), systems(), with_pdf=True)
    assert [path.name for path in written.paths] == [PAGE] and "summary.pdf: not written" in written.problem
    assert not (tmp_path / "summary.pdf").exists()


def test_deviations_of_the_flights_stand_beside_each_other(tmp_path: Path) -> None:
    values = {"a": 0.3, "b": -2.0, "c": 1.5, "d": 0.2, "e": 0.0}
    flown = 6
    columns: dict[str, Any] = {
        "magnetic_verdict": ["accept"] * flown + [""] * 4,
        "magnetic_method": ["poisson_attitude"] * flown + [""] * 4,
        "magnetic_before_rms_deg": [2.0] * flown + [math.nan] * 4,
        "magnetic_after_rms_deg": [0.12] * flown + [math.nan] * 4,
    }
    for letter, value in values.items():
        columns[f"magnetic_{letter}_deg"] = [value] * flown + [math.nan] * 4
        columns[f"magnetic_{letter}_sigma_deg"] = [0.1] * flown + [math.nan] * 4
    columns["magnetic_b_deg"][0] = 3.0  # five degrees from the others of the aircraft
    fleet = fleet_of(10, **columns)
    text = page_of(tmp_path, fleet).text
    assert "Magnetic deviation by aircraft" in text and "iron fit" in text
    changed = [row for row in fleet.deviations if row.coefficients_deg["B"] == 3.0]
    assert len(fleet.deviations) == flown and changed[0].difference_rms_deg == pytest.approx(5.0 / math.sqrt(2.0))
    assert "3.54" in text
    assert "Magnetic deviation by aircraft" not in page_of(tmp_path, fleet_of(10)).text


def test_a_log_that_is_cut_or_damaged_is_not_said_to_have_lost_data() -> None:
    """The flag of the fleet is the same for a cut end and for damage: the remark says no more than it knows."""
    fleet = fleet_of(2, has_lost_data=[True, False])
    told = [
        [mark.text for mark in flights.remarks_of(fleet).get(name, ())] for name in fleet.flights["flight_id"].tolist()
    ]
    assert "log cut or damaged" in told[0] and "log cut or damaged" not in told[1]


def test_a_flight_with_an_ins_off_is_remarked_and_counted(tmp_path: Path) -> None:
    columns = {"units_verdict": ["off", "one_of", "agree", ""], "units_off": ["ins.1", "ins, ins.2", "", ""]}
    fleet = fleet_of(4, **columns)
    remarks = flights.remarks_of(fleet)
    told = [[mark.text for mark in remarks.get(name, ())] for name in fleet.flights["flight_id"].tolist()]
    assert "ins.1 off" in told[0] and "one of ins, ins.2 off" in told[1]
    assert not any(text.endswith(" off") for row in told[2:] for text in row)
    assert "1 flight with an INS off" in page_of(tmp_path, fleet).text
