"""The index of a folder of flights: one row per flight, stable, safe in a spreadsheet."""

import csv
import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from groundstation.pipeline.many_flights.fleet.columns import FLIGHT_COLUMNS, INDEXED, answer_values
from groundstation.reports.index import IndexRow, columns_of, failed_row, index_row, write_index
from groundstation.results.files import save
from groundstation.results.flight import FlightResults
from tests.report_example import MANIFEST, example, heading_result
from tests.saved import load, write_flight_report


def row_of(folder: Path, results: FlightResults) -> IndexRow:
    save(folder / results.flight_id, results, MANIFEST)
    write_flight_report(folder / results.flight_id, with_pdf=False)
    saved = load(folder / results.flight_id)
    return index_row(saved, "flight", answer_values(saved.results))


def written(out: Path) -> tuple[list[dict[str, Any]], list[dict[str, str]]]:
    rows = json.loads((out / "index.json").read_text(encoding="utf-8"))["rows"]
    return rows, list(csv.DictReader(io.StringIO((out / "index.csv").read_text(encoding="utf-8"))))


def test_row_holds_the_answers_of_a_flight(tmp_path: Path) -> None:
    row = row_of(tmp_path, example(heading_result()))
    write_index(tmp_path, [row], INDEXED)
    assert tuple(written(tmp_path)[0][0]) == columns_of(INDEXED)
    expected = {
        "kind": "flight",
        "aircraft": "A12",
        "verdict": "accept",
        "error_deg": 1.0379,
        "confidence95_low_deg": 0.977,
        "confidence95_high_deg": 1.099,
        "correction_deg": -1.05,
        "findings_warn": 1,
        "findings_info": 2,
        "findings_fail": 0,
        "not_assessable": ("magnetic: no magnetometer in the log",),
        "report": "20260504T060000Z_A12_17/report.html",
        "recording": None,
        "reason": None,
    }
    assert {name: {**row.answers, **vars(row)}[name] for name in expected} == expected


def test_flights_stand_by_id_then_what_gave_none(tmp_path: Path) -> None:
    rows = [
        failed_row("z.bin", "skipped", "no reader claims it"),
        failed_row("b.csv", "failed", "no time column"),
        row_of(tmp_path, example(None, flight_id="B")),
        row_of(tmp_path, example(heading_result(), flight_id="A")),
    ]
    write_index(tmp_path, rows, INDEXED)
    first = (tmp_path / "index.json").read_bytes(), (tmp_path / "index.csv").read_bytes()
    write_index(tmp_path, reversed(rows), INDEXED)
    assert first == ((tmp_path / "index.json").read_bytes(), (tmp_path / "index.csv").read_bytes())
    ordered, cells = written(tmp_path)
    assert [row["flight_id"] or row["source"] for row in ordered] == ["A", "B", "b.csv", "z.bin"]
    assert [row["kind"] for row in cells] == ["flight", "flight", "failed", "skipped"]
    assert cells[2]["reason"] == "no time column"
    assert cells[0]["error_deg"] == "1.0379" and cells[1]["error_deg"] == ""


def test_index_links_exist(tmp_path: Path) -> None:
    write_index(tmp_path, [row_of(tmp_path, example(heading_result()))], INDEXED)
    row = written(tmp_path)[0][0]
    assert (tmp_path / row["summary"]).is_file() and (tmp_path / row["report"]).is_file()


def test_links_follow_the_folder(tmp_path: Path) -> None:
    save(tmp_path / "renamed", example(heading_result(), flight_id="../elsewhere"), MANIFEST)
    row = index_row(load(tmp_path / "renamed"))
    assert row.summary == "renamed/summary.json" and row.report is None


def test_no_cell_of_the_csv_runs_as_a_formula(tmp_path: Path) -> None:
    results = example(heading_result(verdict_reason='=HYPERLINK("x")'))
    results = replace(results, metadata={"aircraft": "=1+1", "flight": "@SUM(A1)\n,;\udcff"})
    write_index(tmp_path, [row_of(tmp_path, results), failed_row("-x.csv", "failed", "\t=2")], INDEXED)
    rows, cells = written(tmp_path)
    assert rows[0]["aircraft"] == "=1+1"  # JSON keeps what the log says
    assert cells[0]["aircraft"] == "'=1+1" and cells[0]["verdict_reason"].startswith("'=")
    assert cells[1]["source"] == "'-x.csv" and cells[1]["reason"].startswith("'")
    assert cells[0]["correction_deg"] == "-1.0500"  # a number stays a number


def test_empty_folder_gives_an_empty_index(tmp_path: Path) -> None:
    write_index(tmp_path, [])
    assert written(tmp_path) == ([], [])


def test_every_column_has_a_name_of_its_own() -> None:
    names = [column.name for column in FLIGHT_COLUMNS]
    assert len(set(names)) == len(names)
    assert set(INDEXED) <= set(names)
    assert len(set(columns_of(INDEXED))) == len(columns_of(INDEXED))
