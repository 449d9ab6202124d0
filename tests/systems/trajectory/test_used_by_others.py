"""A log with a filter whose heading becomes wrong: other systems judge and stand beside the best trajectory."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.angles import wrap_360
from groundstation.base.records import Column
from groundstation.pipeline.one_flight.analyse import Answered, answers_of
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.simulation.flat_csv_writer import write_flat_csv
from groundstation.simulation.imu.scenario import ImuScenario, fly
from groundstation.simulation.imu.settings import ImuSettings
from groundstation.simulation.imu.tables import RESOLUTION, log_tables
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.inertial.analysis import INERTIAL
from groundstation.systems.trajectory.answer import BestTrajectory
from groundstation.tables.table import Flight, Table

DURATION_S, WRONG_FROM_S, WRONG_DEG = 400.0, 240.0, 2.0
NOISE = {
    **dict.fromkeys(("latitude_deg", "longitude_deg"), 0.0),
    "altitude_ellipsoid_m": 0.05,
    **{f"velocity_{axis}_mps": 0.02 for axis in ("north", "east", "down")},
    **{f"{angle}_deg": 0.03 for angle in ("roll", "pitch", "true_heading")},
}


def with_filter(flight: Flight) -> Flight:
    """The log of a drive with a filter in place of the truth: right, but for its heading from a time on."""
    rng, truth = np.random.default_rng(1), flight["truth"]
    columns = {name: truth.values(name) + rng.normal(0.0, size, len(truth)) for name, size in NOISE.items()}
    heading = columns["true_heading_deg"] + WRONG_DEG * (flight.seconds(truth.time_ns) >= WRONG_FROM_S)
    columns["true_heading_deg"] = np.asarray(wrap_360(heading))
    named = {name: Column(values) for name, values in columns.items()}
    ins = Table("ins", truth.time_ns, named, truth.record_index, truth.device_time_ns)
    tables = {"imu": flight["imu"], "gnss": flight["gnss"], "ins": ins}
    return replace(flight, tables=tables, metadata={**flight.metadata, "ins_kind": "gnss_aided", "vehicle": "rolls"})


@pytest.fixture(scope="module")
def answered(tmp_path_factory: pytest.TempPathFactory) -> Answered:
    folder: Path = tmp_path_factory.mktemp("drive")
    scenario = ImuScenario(
        "drive", name="drive", unit=ImuSettings(duration_s=DURATION_S, rate_hz=50.0), truth_rate_hz=10.0
    )
    fine = {f"ins.{name}_deg": 1e-9 for name in ("latitude", "longitude")}
    write_flat_csv(
        folder / "drive.csv", with_filter(log_tables(fly(scenario), scenario)), resolution={**RESOLUTION, **fine}
    )
    flight = read_flight(folder / "drive.mcap", convert_log(open_log(folder / "drive.csv"), folder / "drive.mcap"))
    return answers_of(flight, Configuration())[0]


@pytest.mark.slow
def test_the_aided_ins_is_judged_by_it(answered: Answered) -> None:
    best = answered.answers["trajectory"]
    assert isinstance(best, BestTrajectory) and best.state == "accepted"
    (heading,) = [one for one in best.filter_errors("ins") if one.quantity == "heading"]
    worst = heading.wrong[0]
    assert worst.span_s[0] == pytest.approx(WRONG_FROM_S, abs=3.0) or worst.span_s[1] == pytest.approx(
        WRONG_FROM_S, abs=3.0
    )
    sentence = INERTIAL.sentence(answered.answers)
    assert "judged by the best trajectory (heading to" in sentence and "heading wrong by" in sentence
    assert "no errors" not in sentence and "none grows" in answered.reasons["forecast"]
    (told,) = [one for one in answered.findings["inertial"] if one.code == "inertial.gnss_aided"]
    assert "heading wrong by" in told.text and "not estimated" not in told.text


@pytest.mark.slow
def test_the_heading_has_a_second_interval_that_agrees(answered: Answered) -> None:
    found = answered.answers["heading"]
    assert isinstance(found, HeadingResult) and found.by_states is not None
    assert found.by_states.agrees and found.by_states.samples > 100
    low, high = found.by_states.confidence95_deg
    assert low < found.error_deg < high
