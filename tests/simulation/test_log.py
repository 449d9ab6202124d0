"""The flat CSV says what the flight holds, to the digit, and faults are where the scenario puts them."""

import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from groundstation.base.errors import SettingsError
from groundstation.base.timescales import seconds_text_to_ns
from groundstation.simulation.faults import (
    BackwardStep,
    Dropout,
    Duplicate,
    MissingChannel,
    NotANumber,
    Stuck,
    apply_faults,
)
from groundstation.simulation.flat_csv_writer import write_flat_csv
from groundstation.simulation.flight import Simulated, simulate
from groundstation.simulation.samples import write_log, write_scenario
from tests.simulated_flights import scenario


@pytest.fixture(scope="module")
def simulated() -> Simulated:
    sensors = {"baro": {}, "onboard": {}, "magnetometer": {"rate_hz": 5}, "events": [{"time_s": 3.0, "name": 'a, "b"'}]}
    return simulate(scenario(**sensors))


def read_by_hand(path: Path, delimiter: str = ",", encoding: str = "utf-8") -> pd.DataFrame:
    text = path.read_bytes().decode(encoding)
    body = "".join(line for line in io.StringIO(text, newline="") if not line.startswith("#"))
    return pd.read_csv(io.StringIO(body), sep=delimiter, dtype=str, keep_default_na=False)


def test_csv_holds_every_sample_at_its_row(tmp_path: Path, simulated: Simulated) -> None:
    path = tmp_path / "log.csv"
    write_flat_csv(path, simulated.flight, resolution=simulated.resolution, with_truth=True)
    frame = read_by_hand(path)
    times_ns = np.array([seconds_text_to_ns(text) for text in frame["time_s"]])
    assert np.all(np.diff(times_ns) > 0)
    columns = 0
    for topic in simulated.flight.topics():
        table = simulated.flight[topic]
        assert np.array_equal(times_ns[table.record_index], table.device_time_ns.values)
        for name, column in table.columns.items():
            cells = frame[f"{topic}.{name}"].to_numpy()
            filled = np.flatnonzero(cells != "")
            assert np.array_equal(filled, table.record_index[column.mask])
            values = column.values[column.mask]
            if values.dtype.kind == "U":
                assert list(cells[filled]) == list(values)
            else:
                assert np.array_equal(cells[filled].astype(float), values.astype(float)), (topic, name)
            columns += 1
    assert columns == len(frame.columns) - 1


def test_times_are_exact_beyond_the_reach_of_floats(tmp_path: Path) -> None:
    simulated = simulate(scenario(gnss={"latency_s": 0.123456789}))
    path = write_log(simulated, tmp_path)
    frame = read_by_hand(path)
    times_ns = [seconds_text_to_ns(text) for text in frame.loc[frame["gnss.velocity_north_mps"] != "", "time_s"]]
    assert times_ns[:2] == [123_456_789, 223_456_789]


def test_cells_have_the_decimals_of_the_resolution(tmp_path: Path) -> None:
    ins = {"heading_resolution_deg": 360 / 65536, "velocity_resolution_mps": 0.01, "position_resolution_deg": 1e-9}
    frame = read_by_hand(write_log(simulate(scenario(ins=ins)), tmp_path))
    first = frame.iloc[0]
    assert len(first["ins.velocity_north_mps"].partition(".")[2]) == 2
    assert len(first["ins.latitude_deg"].partition(".")[2]) == 9
    steps = frame["ins.true_heading_deg"][frame["ins.true_heading_deg"] != ""].astype(float) / (360 / 65536)
    assert np.max(np.abs(steps - np.rint(steps))) < 1e-3
    assert "truth.latitude_deg" not in frame.columns


def test_long_logs_are_written_in_blocks_without_seams(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    simulated = simulate(scenario())
    whole = write_log(simulated, tmp_path / "whole").read_bytes()
    monkeypatch.setattr("groundstation.simulation.flat_csv_writer.BLOCK_ROWS", 97)
    assert write_log(simulated, tmp_path / "blocks").read_bytes() == whole


def test_the_same_scenario_gives_the_same_bytes(tmp_path: Path) -> None:
    first, second = (write_scenario("taxi-short", tmp_path / name).read_bytes() for name in ("a", "b"))
    assert first == second
    assert write_scenario("taxi-short", tmp_path / "c", seed=99).read_bytes() != first


def test_cp1251_with_semicolons(tmp_path: Path) -> None:
    path = write_scenario("taxi-notime", tmp_path)
    frame = read_by_hand(path, ";", "cp1251")
    assert len(frame.columns) > 5
    head = path.read_bytes().split(b"\n")[0].decode("cp1251")
    assert head.startswith("# aircraft: Л-39")


def test_dropout_takes_the_samples_away(simulated: Simulated) -> None:
    damaged = apply_faults(
        simulated.flight, [Dropout(from_s=4.0, to_s=6.0, topic="gnss"), Dropout(from_s=9.0, to_s=9.5)]
    )
    gnss_s, ins_s = damaged.time_s("gnss"), damaged.time_s("ins")
    assert not np.any((gnss_s >= 4.0) & (gnss_s < 6.0)) and np.any((ins_s >= 4.0) & (ins_s < 6.0))
    assert not np.any((ins_s >= 9.0) & (ins_s < 9.5))
    assert len(damaged["truth"]) == len(simulated.flight["truth"])


def test_duplicates_are_rows_of_their_own(tmp_path: Path, simulated: Simulated) -> None:
    damaged = apply_faults(simulated.flight, [Duplicate(from_s=2.0, to_s=2.5)])
    path = tmp_path / "log.csv"
    write_flat_csv(path, damaged, resolution=simulated.resolution)
    frame = read_by_hand(path)
    again = frame[frame.duplicated(keep=False)]
    assert len(again) == 2 * 25 and set(again["time_s"].astype(float).round(3)) == set(np.arange(200, 250, 2) / 100)
    assert len(damaged["ins"]) == len(simulated.flight["ins"]) + 25
    assert np.all(np.diff(damaged["ins"].record_index) > 0) and np.all(np.diff(damaged["ins"].time_ns) >= 0)


def test_clock_step_changes_the_written_time_alone(tmp_path: Path, simulated: Simulated) -> None:
    damaged = apply_faults(simulated.flight, [BackwardStep(at_s=10.0, step_s=1.5)])
    path = tmp_path / "log.csv"
    write_flat_csv(path, damaged, resolution=simulated.resolution)
    times = read_by_hand(path)["time_s"].astype(float).to_numpy()
    (place,) = np.flatnonzero(np.diff(times) < 0)
    assert times[place] == pytest.approx(9.98) and times[place + 1] == pytest.approx(8.5)
    assert np.array_equal(damaged["ins"].time_ns, simulated.flight["ins"].time_ns)


def test_bad_values_and_missing_channels(tmp_path: Path, simulated: Simulated) -> None:
    faults = [
        Stuck(topic="ins", field="true_heading_deg", from_s=22.0, to_s=26.0),
        NotANumber(topic="gnss", field="velocity_east_mps", from_s=1.0, to_s=2.0),
        MissingChannel(topic="gnss", field="gdop"),
        MissingChannel(topic="baro"),
    ]
    damaged = apply_faults(simulated.flight, faults)
    time_s = damaged.time_s("ins")
    held = damaged["ins"].values("true_heading_deg")[(time_s >= 22.0) & (time_s < 26.0)]
    assert np.ptp(held) == 0.0 and len(held) == 200
    path = tmp_path / "log.csv"
    write_flat_csv(path, damaged, resolution=simulated.resolution)
    frame = read_by_hand(path)
    assert (frame["gnss.velocity_east_mps"] == "nan").sum() == 10
    assert "gnss.gdop" not in frame.columns and not [name for name in frame.columns if name.startswith("baro.")]


def test_fault_on_a_channel_that_is_not_there(simulated: Simulated) -> None:
    with pytest.raises(SettingsError, match=r"no channel gnss\.speed"):
        apply_faults(simulated.flight, [MissingChannel(topic="gnss", field="speed")])


def test_cut_log_loses_its_end(tmp_path: Path, simulated: Simulated) -> None:
    whole, cut = tmp_path / "whole.csv", tmp_path / "cut.csv"
    write_flat_csv(whole, simulated.flight)
    write_flat_csv(cut, simulated.flight, cut_bytes=50)
    assert whole.read_bytes()[:-50] == cut.read_bytes()
