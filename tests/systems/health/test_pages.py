"""Figures and page of autopilot health: lanes coloured by grade, quantities against their limits."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.chapters.markdown import markdown
from groundstation.plots.marks import Curve, Lanes, Limit
from groundstation.results.flight import FlightResults
from groundstation.systems.health.answer import AutopilotHealth, Check, Happening
from groundstation.systems.health.chapter import health
from groundstation.systems.health.plots import PLOTS
from groundstation.systems.health.sentence_answer import told_apart
from tests.report_example import example
from tests.section_contents import rows
from tests.systems.health.made import table
from tests.systems.health.test_px4 import TIME, answered, during, new


@pytest.fixture(scope="module")
def results() -> FlightResults:
    """Results of a flight that shakes from 40 to 60 s, and has only this answer."""
    metric = during(40.0, 60.0, 34.4, 3.1)
    shaken = table("raw.vehicle_imu_status", TIME, accel_vibration_metric=metric, delta_angle_coning_metric=1e-9)
    found = answered(*(one for one in new() if "imu_status" not in one.topic), shaken)
    return replace(example(), answers={"health": found}, figures=found.figures)


def test_lanes_are_red_where_the_limit_was_passed(results: FlightResults) -> None:
    plot = PLOTS["health.lanes"](results)
    assert plot is not None
    lanes = [mark for mark in plot.rows[0].panels[0].marks if isinstance(mark, Lanes)]
    (red,) = [mark for mark in lanes if mark.role == "bad"]
    assert set(red.state) == {"vibration"} and "vibration" in red.order
    assert red.start.min() == pytest.approx(40.0, abs=1.0) and red.end.max() == pytest.approx(60.0, abs=1.0)


def test_a_quantity_stands_against_its_limits(results: FlightResults) -> None:
    plot = PLOTS["health.panels"](results, "vibration")
    assert plot is not None and plot.name == "health.panels.vibration"
    marks = [mark for row in plot.rows for panel in row.panels for mark in panel.marks]
    assert {mark.role for mark in marks if isinstance(mark, Limit)} >= {"warn", "bad"}
    assert max(float(np.nanmax(mark.y)) for mark in marks if isinstance(mark, Curve)) == pytest.approx(34.4, rel=0.01)
    assert PLOTS["health.panels"](results, "battery") is None, "nothing logged, nothing drawn"


def test_the_chapter_opens_with_what_failed(results: FlightResults) -> None:
    section = health(results)
    assert section is not None and section.claim is not None
    assert section.claim.mark.tone == "bad" and section.claim.is_danger
    assert section.claim.headline == section.headline == "Vibration high 0:40-1:00"
    assert section.claim.sentences[0].startswith("GNSS good, filter healthy")
    assert "Not logged" in markdown(section)


def test_what_happened_is_listed_in_the_order_of_time(results: FlightResults) -> None:
    """A setting that the flight contradicts is found last and belongs to the start."""
    found = results.answer(AutopilotHealth)
    assert found is not None
    told = [Happening(at_s, "modes", "info", f"at {at_s:g} s", "raw.MODE", True) for at_s in (1.0, 177.0, 30.0)]
    section = health(replace(results, answers={"health": replace(found, happenings=tuple(told))}))
    assert section is not None
    assert [row[2] for row in rows(section, "Modes and remarks logged")] == ["at 1 s", "at 30 s", "at 177 s"]


def test_a_failure_throughout_stands_before_the_first_that_has_a_time() -> None:
    shaken = table("raw.vehicle_imu_status", TIME, accel_vibration_metric=34.4, delta_angle_coning_metric=1e-9)
    found = answered(*(one for one in new() if "imu_status" not in one.topic), shaken)
    lasting = found.check("vibration")
    battery = Check("battery", "battery", "fail", "voltage critical; 9.1 V", (), first_event_s=79.0)
    late = Check("faults", "faults", "fail", "failsafe", (), first_event_s=85.0)
    doubt = Check("timing", "timing", "warn", "CPU", (), first_event_s=20.0)
    assert lasting.verdict == "fail"
    first, rest = told_apart((lasting, battery, doubt))
    assert first == "Vibration high throughout; “voltage critical” at 1:19"
    assert rest == ("Timing or log with losses at 0:20",)
    first, rest = told_apart((battery, late, doubt))
    assert first == "First: “voltage critical” at 1:19.0" and rest[0] == "Then “failsafe” at 1:25.0"
    assert told_apart((doubt,))[0] == "Timing or log with losses at 0:20"
    assert told_apart((found.check("gnss"),)) == ("GNSS good", ())
