"""Typed arrays: nobody asks for a column by text, what may be absent is listed, and an older run is still read."""

import ast
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

import groundstation
from groundstation.base.failures import failures, gathered_failures
from groundstation.cli.main import app
from groundstation.results.arrays.typed import Arrays, MissingColumnError, joined
from groundstation.results.figures import FigureData
from groundstation.results.files import OLD_COLUMNS
from groundstation.systems.heading.arrays import HeadingSamples, StandstillVelocity
from groundstation.systems.heading.fleet_share import heading_samples
from groundstation.systems.inertial.arrays import DifferencesOfChannel, InertialDifferences
from groundstation.systems.magnetic.arrays import GroundRunCurve
from groundstation.systems.reference.arrays import ReferenceErrors
from tests.figure_arrays import filled, kinds
from tests.saved import load

PACKAGE = Path(groundstation.__file__).parent
GOOD = PACKAGE.parent / "sample_logs" / "taxi-good.csv"
# What only some flights have: a sensor, an INS that GNSS does not correct, a forecast that claims a sigma.
OPTIONAL = {
    "overview": {
        *("roll_deg", "pitch_deg", "magnetic_heading_deg", "true_airspeed_mps", "indicated_airspeed_mps"),
        *("pressure_altitude_m", "height_above_airfield_m"),
    },
    "inertial_track": {
        *("corrected_latitude_deg", "corrected_longitude_deg", "reference_latitude_deg", "reference_longitude_deg"),
        *("ins_error_m", "corrected_error_m"),
    },
    "forecast_growth": {"sigma_m"},
    "cooperative_links": {"range_m", "range_sigma_m"},  # sessions of earlier versions
    "phases": {"proven"},
    "trajectory_states": {"altitude_ellipsoid_m", "altitude_msl_m"},  # one of them, by the datum of GNSS
    "trajectory_track": {"other_heading_deg"},
}
BY_TEXT = {"numbers", "flags", "texts", "figure_with_rows"}
# Arrays of anybody's analysis; the fleet's table of flights, whose columns the analyses list; UTC beside any figure.
MAY_ASK_BY_TEXT = {
    *("chapters/generic.py", "chapters/plots/generic.py"),
    "chapters/plots/fleet/trend.py",
    *(f"systems/health/{name}.py" for name in ("messages", "mavlink", "px4")),  # fields of raw messages
    *("pipeline/verbs/export_figures.py", "results/figures.py", "results/flight.py"),
}


def asked_by_text() -> Iterator[tuple[str, int]]:
    """Places that ask a figure for a column, or a flight for a figure, by its name as text."""
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if name.startswith(("readers/", "base/")):
            continue  # functions of their own under these names
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if any(called in text for called in BY_TEXT) else ():
            if isinstance(node, ast.Call) and node.args:
                called = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
                is_own = isinstance(node.func, ast.Attribute) and called != "figure_with_rows"
                if called in BY_TEXT and not is_own:
                    yield name, node.lineno


def test_nobody_asks_for_a_column_by_text() -> None:
    found = list(asked_by_text())
    assert {name for name, _ in found} <= MAY_ASK_BY_TEXT, found
    assert {name for name, _ in found} == MAY_ASK_BY_TEXT


def test_columns_that_may_be_absent_are_listed() -> None:
    optional = {
        name: {one.name for one in fields(cast(Any, kind)) if one.default is None} for name, kind in kinds().items()
    }
    assert {name: columns for name, columns in optional.items() if columns} == OPTIONAL


def test_every_figure_of_a_run_is_typed_and_read_back(tmp_path: Path) -> None:
    assert CliRunner().invoke(app, ["run", str(GOOD), "-o", str(tmp_path), "--only", "results"]).exit_code == 0
    (folder,) = (path.parent for path in tmp_path.glob("*/summary.json"))
    saved = load(folder)
    assert len(saved.figures) > 10
    for name, figure in saved.figures.items():
        typed = kinds()[name].of(figure)
        assert list(typed.columns) == list(figure.columns) and dict(typed.digits) == dict(figure.digits), name
        for column, values in figure.columns.items():
            assert typed[column].dtype.kind == values.dtype.kind, (name, column)
            np.testing.assert_array_equal(typed[column], values)


def test_a_run_of_an_older_version_is_read_with_its_own_names(tmp_path: Path) -> None:
    """Names were changed; report, compare and fleet read arrays that were saved before."""
    assert CliRunner().invoke(app, ["run", str(GOOD), "-o", str(tmp_path), "--only", "results"]).exit_code == 0
    (folder,) = (path.parent for path in tmp_path.glob("*/summary.json"))
    now = load(folder).rows_of(HeadingSamples)
    changed = 0
    for path in (folder / "arrays").glob("*.parquet"):
        old = {new: name for name, new in OLD_COLUMNS.get(path.stem, {}).items()}
        table = pq.read_table(path)
        changed += len(set(old) & set(table.column_names))
        pq.write_table(table.rename_columns([old.get(name, name) for name in table.column_names]), path)
    assert changed == 2
    saved = load(folder)
    samples, still = saved.rows_of(HeadingSamples), saved.rows_of(StandstillVelocity)
    assert now is not None and samples is not None and still is not None
    assert samples.is_used.tolist() == now.is_used.tolist() and still.is_in_interval.any()
    for verb in (["report", str(folder), "--no-pdf"], ["compare", str(folder), str(folder), "-o", str(tmp_path / "c")]):
        done = CliRunner().invoke(app, verb)
        assert done.exit_code == 0, done.output
    assert "Heading minus track over time" in (folder / "report.html").read_text(encoding="utf-8")
    done = CliRunner().invoke(app, ["report", str(tmp_path), "--no-pdf"])
    assert done.exit_code == 0, done.output
    of_fleet = heading_samples(saved)
    assert of_fleet is not None and int(of_fleet.columns["used"].sum()) == int(now.is_used.sum())


@pytest.mark.parametrize(
    ("kind", "old", "new"),
    [(GroundRunCurve, "error_deg", "heading_error_deg"), (ReferenceErrors, "north_mps", "north_error_mps")],
)
def test_old_names_of_what_the_sample_lacks(kind: type[Arrays], old: str, new: str) -> None:
    assert OLD_COLUMNS[kind.figure][old] == new and new in filled(kind.figure, **{new: np.zeros(1)}).columns


def test_a_column_that_lacks_is_told_and_the_rest_goes_on(tmp_path: Path) -> None:
    assert CliRunner().invoke(app, ["run", str(GOOD), "-o", str(tmp_path), "--only", "results"]).exit_code == 0
    (folder,) = (path.parent for path in tmp_path.glob("*/summary.json"))
    path = folder / "arrays" / "heading_running.parquet"
    pq.write_table(pq.read_table(path).drop_columns("honest_half_width_deg"), path)
    done = CliRunner().invoke(app, ["report", str(folder), "--no-pdf"])
    assert "no column honest_half_width_deg: run the log again" in done.output
    assert "Heading minus track over time" in (folder / "report.html").read_text(encoding="utf-8")


def test_figures_keep_their_order_types_and_names() -> None:
    part = DifferencesOfChannel(position_m=[1, 2], velocity_mps=[0.1, 0.2])  # type: ignore[arg-type]
    made = InertialDifferences(time_s=np.array([0.0, 1.0]), north=part, east=part)
    assert list(made.columns)[:3] == ["time_s", "north_position_m", "north_velocity_mps"] and len(made) == 2
    assert made.north.position_m.dtype == np.float64 and not made.north.position_m.flags.writeable
    assert joined([made, made]).east.velocity_mps.tolist() == [0.1, 0.2, 0.1, 0.2]
    broken = made.with_breaks(np.array([0]), time_s=[0.5])
    assert broken.time_s.tolist() == [0.0, 0.5, 1.0] and np.isnan(broken.north.position_m[1])
    assert made.where(made.time_s > 0.0).east.position_m.tolist() == [2.0]


def test_a_figure_without_a_column_raises_where_nobody_gathers() -> None:
    with pytest.raises(MissingColumnError, match="no column north_position_m: run the log again"):
        InertialDifferences.of(FigureData("inertial_differences", {"time_s": np.zeros(1)}, {}))
    with gathered_failures():
        assert failures() == ()
