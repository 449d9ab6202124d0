"""The recording as a file: read back with Rerun's own reader and held against tables and results."""

import os
import re
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
import rerun as rr

from groundstation.base.attitude import quaternion_enu_from_flu_xyzw
from groundstation.base.errors import GroundstationError
from groundstation.base.records import Column
from groundstation.plots.ranges import windows
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults, Source
from groundstation.systems.heading.answer import HeadingResult
from groundstation.tables.table import Flight
from groundstation.viewer import recording
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.tabs import raw
from groundstation.viewer.tabs.log import place_s
from tests.markup import foreign_markup
from tests.recording_contents import Contents
from tests.told import front, stream_recording, write_recording
from tests.viewer_example import GNSS_GAP_S, START_NS, make_flight, make_results, table
from tests.viewer_shots import free_port

MANY_TOPICS_S = 60.0  # it takes one; without a cap it never ends
HOSTILE = [
    "raw.../../etc/passwd",
    "raw.a b\x00\n\u202ec",
    "raw.<script>alert(1)</script>",
    "raw.![x](http://127.0.0.1/x)",
    "raw.**|`$origin/**`",
    "raw." + "long" * 400,
    "raw.a:b",
    "raw.a/b",
]


@pytest.fixture(scope="module")
def flight() -> Flight:
    return make_flight(240.0, 50.0)


@pytest.fixture(scope="module")
def results(flight: Flight) -> FlightResults:
    return make_results(flight)


@pytest.fixture(scope="module")
def contents(flight: Flight, results: FlightResults, tmp_path_factory: pytest.TempPathFactory) -> Contents:
    path = tmp_path_factory.mktemp("recording") / "flight.rrd"
    write_recording(path, flight, results)
    assert [entry.name for entry in path.parent.iterdir()] == ["flight.rrd"], "a temporary file stayed behind"
    return Contents(path)


def test_exactly_the_two_timelines_on_every_row(contents: Contents) -> None:
    assert contents.timelines == {"utc", "flight_time"}
    for entity, batches in contents.batches.items():
        for batch in batches:
            flight_ns = np.asarray(batch.column("flight_time").cast(pa.int64()))
            utc_ns = np.asarray(batch.column("utc").cast(pa.int64()))
            assert (utc_ns - flight_ns == START_NS).all(), entity


def test_a_flight_without_utc_has_flight_time_alone(tmp_path: Path) -> None:
    flight = make_flight(200.0, 10.0, has_utc=False)
    write_recording(tmp_path / "a.rrd", flight, make_results(flight, flight_id="NOTIME_01234567"))
    assert Contents(tmp_path / "a.rrd").timelines == {"flight_time"}


def test_identity_and_embedded_layout(contents: Contents, results: FlightResults) -> None:
    assert contents.store.recording_id == results.flight_id
    assert re.fullmatch(r"[A-Za-z0-9_ -]+", contents.store.application_id)
    assert len(contents.blueprints) == 1
    assert contents.blueprints[0].application_id == contents.store.application_id


def test_nothing_is_dropped_and_values_are_those_of_the_tables(contents: Contents, flight: Flight) -> None:
    names = ("velocity_north_mps", "velocity_east_mps", "velocity_down_mps")
    time_ns, values = contents.scalars("/raw/ins/velocity")
    assert (time_ns == flight["ins"].time_ns - START_NS).all()
    assert (values == np.column_stack([flight["ins"].values(name) for name in names])).all()
    numeric = {
        (topic, name)
        for topic in flight.topics()
        for name, column in flight[topic].columns.items()
        if column.values.dtype.kind == "f"
    }
    shown = 0
    for entity in contents.batches:
        if entity.startswith("/raw/") and "states" not in entity:
            shown += contents.scalars(entity)[1].shape[1]
    assert shown == len(numeric)


def test_a_gap_is_a_row_of_nan(contents: Contents, flight: Flight) -> None:
    time_ns, values = contents.scalars("/raw/gnss/velocity")
    gap_ns = round(GNSS_GAP_S[0] * 1e9) + 1
    assert len(time_ns) == len(flight["gnss"]) + 1
    assert np.isnan(values[time_ns == gap_ns]).all() and np.isfinite(values[time_ns != gap_ns]).all()


def test_lines_break_where_a_heading_crosses_north(contents: Contents) -> None:
    values = contents.scalars("/overview/directions/heading_deg")[1][:, 0]
    steps = np.abs(np.diff(values))
    assert np.nanmax(steps) < 180.0


def test_the_aircraft_moves_and_turns_along_its_track(contents: Contents, results: FlightResults) -> None:
    figure = results.figure("overview")
    assert figure is not None
    (batch,) = contents.batches["/space/aircraft"]
    place, turn = (
        np.array([row[0] for row in batch.column(f"Transform3D:{name}").to_pylist()])
        for name in ("translation", "quaternion")
    )
    assert place[:, 2] == pytest.approx(figure["altitude_m"] - figure["altitude_m"].min(), abs=0.01)
    moved_m = np.hypot(*np.diff(place[:, :2], axis=0).T)
    steps_s = np.diff(figure["time_s"])
    assert moved_m.sum() == pytest.approx((figure["ground_speed_mps"][1:] * steps_s).sum(), rel=0.01)
    expected = [figure[f"{name}_deg"] for name in ("roll", "pitch", "heading")]
    assert turn == pytest.approx(quaternion_enu_from_flu_xyzw(*expected), abs=1e-6)


def test_every_answer_has_a_row_in_the_overview(contents: Contents, results: FlightResults) -> None:
    told = contents.text("/summary").replace("\\", "")
    top = front(results)
    assert top.others
    for title, line in ((top.subject, top.line), *((tile.title, tile.claim.line) for tile in top.others)):
        assert f"| {title} | {line} |" in told
    for subject, reason in top.missing:
        assert f"**{subject}**: {reason}" in told


def test_results_are_properties_with_both_ends_of_an_interval(contents: Contents, results: FlightResults) -> None:
    answer = results.answer(HeadingResult)
    assert answer is not None
    (row,) = (batch.to_pylist()[0] for batch in contents.fixed["/__properties/heading"])
    assert row["error_deg"] == [answer.error_deg] and row["verdict"] == [answer.verdict]
    assert row["confidence95_low_deg"] + row["confidence95_high_deg"] == list(answer.confidence95_deg)
    (flight,) = (batch.to_pylist()[0] for batch in contents.fixed["/__properties/flight"])
    assert flight["source"] == [results.source.name] and flight["findings_warn"] == [1.0]


def test_a_taxi_in_a_long_flight_has_a_time_axis_of_its_own(
    tmp_path: Path, contents: Contents, flight: Flight, results: FlightResults
) -> None:
    assert not any("/heading/run/" in entity for entity in contents.fixed), "here it fills most of the flight"
    write_recording(tmp_path / "a.rrd", flight, replace(results, duration_s=3600.0))
    long = Contents(tmp_path / "a.rrd")
    samples = results.figure("heading_samples")
    assert samples is not None
    (drawn,) = (
        batch.column("Points2D:positions").to_pylist()[0]
        for batch in long.fixed["/heading/run/1/INS_heading___GNSS_track/00_dots/1"]
    )
    assert len(drawn) == np.isfinite(samples["difference_deg"][samples["is_used"]]).sum()
    ((low_s, high_s),) = windows(samples["time_s"][samples["is_used"]])
    cursor_s = np.sort(long.times("/heading/run/1/ground_speed/cursor")) / 1e9
    assert cursor_s[0] == pytest.approx(low_s) and cursor_s[-2] == pytest.approx(high_s)


def test_absent_is_no_gap_and_nan_of_the_device_is_one(tmp_path: Path) -> None:
    time_s = np.arange(0.0, 100.0, 0.1)
    slow = np.arange(len(time_s)) % 10 == 0
    reading = np.where((time_s > 40.0) & (time_s < 45.0), np.nan, time_s)
    one = table("gnss", time_s, gdop=Column(time_s, slow), velocity_north_mps=reading)
    flight = Flight({"gnss": one}, {}, START_NS, True, "a.csv")
    write_recording(tmp_path / "a.rrd", flight, _bare_results(flight))
    contents = Contents(tmp_path / "a.rrd")
    sparse = contents.scalars("/raw/gnss/gdop")[1]
    assert len(sparse) == slow.sum() and np.isfinite(sparse).all()
    assert np.isnan(contents.scalars("/raw/gnss/velocity_north")[1]).sum() == np.isnan(reading).sum()


def test_long_topics_are_thinned_without_losing_an_extreme_and_say_so(
    tmp_path: Path, flight: Flight, results: FlightResults, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(raw, "SCALARS", 30_000)
    write_recording(tmp_path / "a.rrd", flight, results)
    contents = Contents(tmp_path / "a.rrd")
    time_ns, values = contents.scalars("/raw/ins/rate")
    every = np.column_stack([flight["ins"].values(f"rate_{axis}_dps") for axis in "xyz"])
    assert len(time_ns) < len(every) / 3
    assert (values.min(axis=0) == every.min(axis=0)).all() and (values.max(axis=0) == every.max(axis=0)).all()
    rows = np.searchsorted(flight["ins"].time_ns - START_NS, time_ns)
    assert (every[rows] == values).all(), "a value was altered"
    assert f"of {len(every)} rows" in contents.text("/raw/about")


@pytest.mark.parametrize(
    ("place", "seconds"),
    [("at 61.3 s", 61.3), ("2026-05-04T06:01:40.500Z", 100.5), ("row 12", 0.0), ("2031-01-01T00:00:00Z", 0.0)],
)
def test_a_finding_stands_where_its_place_says(flight: Flight, place: str, seconds: float) -> None:
    assert place_s(place, flight) == seconds


def test_a_text_too_busy_for_a_lane_is_named(tmp_path: Path) -> None:
    time_s = np.arange(0.0, 600.0, 0.1)
    one = table("event", time_s, name=np.array([f"step {row}" for row in range(len(time_s))]))
    flight = Flight({"event": one}, {}, START_NS, True, "a.csv")
    write_recording(tmp_path / "a.rrd", flight, _bare_results(flight))
    assert "not shown: event.name" in Contents(tmp_path / "a.rrd").text("/raw/about")


def test_lists_are_tables_and_the_clock_of_a_topic_is_not_drawn(tmp_path: Path) -> None:
    seconds = np.arange(20.0, 120.0, 1.0)
    parameters = table("raw.PARM", np.zeros(50), Name=np.array([f"P_{n}" for n in range(50)]), Value=np.arange(50.0))
    attitude = table(
        "raw.ATT", seconds, TimeUS=(seconds * 1e6).astype(np.int64), accel_m_s=seconds, Flags=np.arange(100) % 7
    )
    clock = Column((seconds * 1e9).astype(np.int64))
    tables = {"raw.PARM": parameters, "raw.ATT": replace(attitude, device_time_ns=clock)}
    logged = Flight(tables, {}, START_NS, True, "a.BIN")
    write_recording(tmp_path / "a.rrd", logged, _bare_results(logged))
    contents = Contents(tmp_path / "a.rrd")
    text = contents.text("/raw/raw.PARM/states")
    assert "| P\\_7 | 7 |" in text and "50 rows" in text
    drawn = {entity for entity in contents.batches if entity.startswith("/raw/raw.")}
    assert drawn == {"/raw/raw.ATT/accel_m", "/raw/raw.ATT/Flags"}


def test_units_of_the_source_stand_in_titles_and_counts_are_stepped(tmp_path: Path) -> None:
    seconds = np.arange(0.0, 100.0, 1.0)
    rows = table("raw.IMU.0", seconds, acc_x=seconds, acc_y=seconds, T=seconds, mode_no=np.arange(100) // 30)
    metadata = {"units.raw.IMU": "acc_x m/s/s, acc_y m/s/s, T deg C"}
    logged = Flight({"raw.IMU.0": rows}, metadata, START_NS, True, "a.BIN")
    with rr.RecordingStream("a") as stream:
        stream.save(tmp_path / "a.rrd")
        tab = raw.raw(Recorder(stream, logged.start_ns, True), logged, _bare_results(logged))
        stream.disconnect()
    assert tab is not None
    titles = {view.name for page in tab.contents[0].contents for view in page.contents}
    assert titles == {"IMU.0 acc, m/s/s", "IMU.0 T, deg C", "IMU.0 mode_no"}
    styles = Contents(tmp_path / "a.rrd").fixed
    stepped = {
        path
        for path, batches in styles.items()
        for batch in batches
        if "SeriesLines:interpolation_mode" in batch.schema.names
    }
    assert stepped == {"/raw/raw.IMU.0/mode_no"}


def test_a_state_is_held_over_rows_of_other_sources(tmp_path: Path) -> None:
    seconds = np.arange(0.0, 100.0, 0.5)
    is_own = np.arange(200) % 4 == 0
    mode = np.where(seconds < 50.0, "align", "nav")
    ins = table("ins", seconds, roll_deg=Column(seconds, ~is_own), mode=Column(mode, is_own))
    logged = Flight({"ins": ins}, {}, START_NS, True, "a.ulg")
    write_recording(tmp_path / "a.rrd", logged, _bare_results(logged))
    changes = Contents(tmp_path / "a.rrd").batches["/raw/ins/states/mode"]
    assert sum(batch.num_rows for batch in changes) == 2


def test_rare_records_of_a_raw_topic_are_joined(tmp_path: Path) -> None:
    seconds = np.cumsum(np.where(np.arange(40) % 2, 30.0, 0.1))
    logged = Flight({"raw.command": table("raw.command", seconds, command=seconds)}, {}, START_NS, True, "a.ulg")
    gaps = FigureData(
        "gaps",
        {"topic": np.full(40, "raw.command"), "start_s": seconds, "length_s": np.full(40, 30.0)},
        {},
    )
    write_recording(tmp_path / "a.rrd", logged, replace(_bare_results(logged), figures=(gaps,)))
    contents = Contents(tmp_path / "a.rrd")
    assert np.isfinite(contents.scalars("/raw/raw.command/command")[1]).all()
    assert "/log/gaps" not in contents.batches  # raw gaps are findings and lanes


def test_growing_density_stands_below_an_axis_that_stands_still(contents: Contents) -> None:
    def heights(batch: pa.RecordBatch) -> float:
        return max(max(row[0]["buffer"]) for row in batch.column("BarChart:values").to_pylist())

    top = heights(contents.fixed["/distribution/axis_top"][0])
    grown = contents.batches["/distribution/samples_so_far"]
    assert sum(batch.num_rows for batch in grown) > 10
    assert max(heights(batch) for batch in grown) <= top
    assert heights(contents.fixed["/distribution/samples_all"][0]) <= top


def test_bars_stand_where_their_bins_are(contents: Contents, flight: Flight) -> None:
    """Rerun takes the abscissa of a bar for its left edge."""

    def spans(batch: pa.RecordBatch) -> np.ndarray:
        left = np.array(batch.column("BarChart:abscissa").to_pylist()[0][0]["buffer"])
        return np.stack([left, left + np.array(batch.column("BarChart:widths").to_pylist()[0])])

    figures = {figure.name: figure for figure in make_results(flight).figures}
    bins, normal, growth = (figures[f"heading_{name}"] for name in ("distribution", "normal", "growth"))
    whole = spans(contents.fixed["/distribution/samples_all"][0])
    assert whole == pytest.approx(np.stack([bins["bin_low_deg"], bins["bin_high_deg"]]), abs=1e-5)
    fitted = spans(contents.fixed["/distribution/fitted_normal"][0])
    assert fitted.mean(axis=0) == pytest.approx(normal["difference_deg"], abs=1e-5)
    charts = contents.batches["/distribution/samples_so_far"]
    told = [batch for batch in charts if "BarChart:abscissa" in batch.schema.names]
    grown = spans(told[0])
    assert grown.mean(axis=0) == pytest.approx(growth["bin_center_deg"][: grown.shape[1]], abs=1e-5)
    assert [batch.num_rows for batch in told] == [1] < [len(charts)]  # from the first chart on the places hold
    first_ns, times_ns = np.asarray(told[0].column("flight_time").cast(pa.int64())), contents.times
    assert first_ns[0] == times_ns("/distribution/samples_so_far").min()


def test_findings_and_events_stand_in_the_log_with_severity_and_time(contents: Contents) -> None:
    batch = contents.batches["/log/findings"][0]
    at = {row: level[0] for row, level in enumerate(batch.column("TextLog:level").to_pylist())}
    times = np.asarray(batch.column("flight_time").cast(pa.int64()))
    assert [at[row] for row in np.argsort(times)] == ["INFO", "WARN"]
    assert times.max() == 61_300_000_000
    assert sum(batch.num_rows for batch in contents.batches["/log/events"]) == 2


def test_a_finding_about_a_stretch_stands_at_its_begin(flight: Flight) -> None:
    assert place_s("78.5 to 81.1 s", flight) == 78.5
    assert place_s("from 7 to 9 s", flight) == 7.0
    assert place_s("3 to 5 rows", flight) == 0.0


def test_without_a_heading_the_overview_says_why_and_there_is_no_tab(tmp_path: Path, flight: Flight) -> None:
    write_recording(tmp_path / "a.rrd", flight, make_results(flight, with_heading=False))
    contents = Contents(tmp_path / "a.rrd")
    assert "no GNSS velocity in the log" in contents.text("/summary")
    assert "/heading/verdict" not in contents.fixed
    assert not [entity for entity in contents.batches if entity.startswith("/distribution")]


def test_number_to_type_and_gates_stand_in_the_panel(contents: Contents) -> None:
    text = contents.text("/heading/verdict")
    assert text.splitlines()[0] == "# ✓ Accept · Enter −1.2°"
    assert "no GDOP in the log" in text and "**○ not measured**" in text


def test_hostile_names_reach_neither_paths_nor_markup(tmp_path: Path, flight: Flight) -> None:
    seconds = np.arange(0.0, 100.0, 1.0)
    tables = {
        name: table(name, seconds, **{"x/../y\n`|": seconds, "state\x1b[0m": np.full(100, "a\x00|b")})
        for name in HOSTILE
    }
    hostile = Flight({**flight.tables, **tables}, {}, START_NS, True, "|.csv")
    results = replace(make_results(hostile), metadata={"aircraft": "<img src=x>", "flight": "![x](http://y)"})
    write_recording(tmp_path / "a.rrd", hostile, results)
    contents = Contents(tmp_path / "a.rrd")
    paths = [entity for entity in contents.batches if entity.startswith("/raw/raw.")]
    assert len(paths) == 2 * (len(HOSTILE) + 1), "one path for each topic and kind of field, the example's own too"
    assert all(re.fullmatch(r"/raw/raw\.[\w.-]+(/states)?/[\w.-]+", path) for path in paths), paths
    for entity in ("/quality/ledger", "/raw/about", "/summary"):
        text = contents.text(entity)
        assert not foreign_markup(text) and "\x00" not in text


@pytest.mark.parametrize("nothing", [{}, {"ins": table("ins", np.zeros(0))}])
def test_a_flight_without_data_still_gives_a_recording(tmp_path: Path, nothing: dict) -> None:
    flight = Flight(nothing, {}, START_NS, True, "a.csv")
    write_recording(tmp_path / "a.rrd", flight, _bare_results(flight))
    assert "/quality/ledger" in Contents(tmp_path / "a.rrd").fixed


def test_an_hour_at_100_hz_stays_small(tmp_path: Path) -> None:
    flight = make_flight(3600.0, 100.0)
    write_recording(tmp_path / "a.rrd", flight, make_results(flight))
    assert (tmp_path / "a.rrd").stat().st_size < 30e6


def test_a_failure_leaves_no_file_and_the_strictness_as_it_was(
    tmp_path: Path, flight: Flight, results: FlightResults, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ValueError("broken")

    before = rr.strict_mode()
    monkeypatch.setattr(recording, "log", fail)
    with pytest.raises(ValueError, match="broken"):
        write_recording(tmp_path / "a.rrd", flight, results)
    assert not list(tmp_path.iterdir())
    assert rr.strict_mode() == before


def test_a_folder_that_is_not_there_is_one_line(tmp_path: Path, flight: Flight, results: FlightResults) -> None:
    with pytest.raises(GroundstationError, match="check the folder"):
        write_recording(tmp_path / "missing" / "a.rrd", flight, results)


def test_streaming_to_nobody_is_said_at_once(flight: Flight, results: FlightResults) -> None:
    with pytest.raises(GroundstationError, match="start the viewer first"):
        stream_recording(flight, results, connect_url=f"rerun+http://127.0.0.1:{free_port()}/proxy")


def test_ten_thousand_topics_are_recorded_and_those_without_a_page_are_named(tmp_path: Path) -> None:
    time_s = np.arange(3.0)
    names = [*(f"raw.t{number}" for number in range(10_000)), "ins"]
    flight = Flight({name: table(name, time_s, roll_deg=time_s) for name in names}, {}, START_NS, True, "a.csv")
    started = time.monotonic()
    write_recording(tmp_path / "a.rrd", flight, _bare_results(flight))
    assert time.monotonic() - started < MANY_TOPICS_S
    contents = Contents(tmp_path / "a.rrd")
    about = contents.text("/raw/about")
    assert f"{10_001 - raw.MAX_TOPICS} topics beyond" in about and "raw.t9999" in about
    assert "/raw/ins/roll" in contents.batches  # canonical topics come first


def test_fewer_views_a_topic_where_there_are_many_topics(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(raw, "MAX_ALL_VIEWS", 6)
    time_s = np.arange(3.0)
    fields = {f"{letter}_deg": time_s for letter in "abcdef"}
    flight = Flight({f"raw.t{n}": table(f"raw.t{n}", time_s, **fields) for n in range(3)}, {}, START_NS, True, "a.csv")
    with rr.RecordingStream("a") as stream:
        stream.save(tmp_path / "a.rrd")
        tab = raw.raw(Recorder(stream, flight.start_ns, True), flight, _bare_results(flight))
    assert tab is not None
    (other, _about) = tab.contents
    assert [len(page.contents) for page in other.contents] == [2, 2, 2]
    assert all(page.contents[1].name == "5 more" for page in other.contents)


@pytest.mark.parametrize("absurd", [1e308, -1e308, 1e30, np.inf, 91.0])
def test_positions_that_are_none_are_left_out_of_the_track(tmp_path: Path, absurd: float) -> None:
    flight = make_flight(duration_s=200.0, rate_hz=10.0)
    results = make_results(flight)
    figures = []
    for figure in results.figures:
        columns = dict(figure.columns)
        if figure.name == "overview":
            for name in ("latitude_deg", "altitude_m", "ground_speed_mps"):
                columns[name] = np.where(np.arange(len(figure)) % 50 == 0, absurd, columns[name])  # the first row too
        figures.append(FigureData(figure.name, columns, figure.digits))
    write_recording(tmp_path / "a.rrd", flight, replace(results, figures=tuple(figures)))
    assert "/plan/now" in Contents(tmp_path / "a.rrd").batches


def test_rerun_writes_no_log_lines_of_its_own() -> None:
    code = "import groundstation.viewer.recording, os; print(os.environ['RUST_LOG'])"
    environment = {name: value for name, value in os.environ.items() if name != "RUST_LOG"}
    run = partial(subprocess.run, [sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run(env=environment).stdout == "off\n"
    assert run(env=environment | {"RUST_LOG": "debug"}).stdout == "debug\n"  # who asks for it gets it


def _bare_results(flight: Flight) -> FlightResults:
    """Results without a single figure."""
    source = Source("a.csv", "0" * 64, 0, "flat-csv")
    return FlightResults("20260504T060000Z", source, {}, START_NS, flight.duration_s, "failed")


def test_a_recording_leaves_no_thread_behind(tmp_path: Path, flight: Flight, results: FlightResults) -> None:
    """A process that writes many recordings keeps the threads of none; Rerun's own way to send a layout leaves two."""

    def threads() -> int:
        return len(list(Path("/proc/self/task").iterdir()))

    write_recording(tmp_path / "first.rrd", flight, results)
    before = threads()
    for number in range(4):
        write_recording(tmp_path / f"{number}.rrd", flight, results)
    assert threads() <= before
