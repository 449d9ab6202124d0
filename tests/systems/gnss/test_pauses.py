"""Reception over a pause of the log while disarmed: no time of the receiver, no loss, a lane of its own."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from groundstation.base.gaps import Pause
from groundstation.base.signals import is_canonical
from groundstation.base.units import NS_PER_S
from groundstation.methods.overview import gnss_lanes
from groundstation.pipeline.api import open_flight
from groundstation.systems.gnss.answer import GnssReceiver, GnssReception
from groundstation.systems.gnss.estimate import Reception, reception_of
from groundstation.systems.gnss.settings import GnssSettings
from groundstation.tables.table import Flight
from tests.real_logs import real_log
from tests.systems.gnss.made import STEP_S, WHOLE_S, flight, shares, table, times, unknown_phases

PAUSE_S = (100.0, 130.0)


def paused(start_s: float = PAUSE_S[0], end_s: float = PAUSE_S[1], *, is_known: bool = True) -> Flight:
    """A flight whose receiver and barometer have no rows from start to end, with or without a known pause."""
    time_s = times()
    kept = time_s[(time_s < start_s) | (time_s >= end_s)]
    beside = np.arange(0.0, WHOLE_S, 0.1)
    beside = beside[(beside < PAUSE_S[0]) | (beside >= PAUSE_S[1])]
    baro = replace(table(beside, pressure_altitude_m=np.zeros(len(beside))), topic="baro")
    pause = Pause(*(round(end * NS_PER_S) for end in PAUSE_S))
    return replace(flight(table(kept), baro), pauses=(pause,) if is_known else ())


def assessed(of: Flight) -> Reception:
    return reception_of(of, unknown_phases(), settings=GnssSettings())


def seconds(one: GnssReceiver, state: str) -> float:
    return sum(found.seconds for found in one.states if found.state == state)


def test_a_pause_takes_no_share_and_loses_no_epoch() -> None:
    found = assessed(paused())
    one = found.answer.receiver
    assert shares(one) == {"3d": 1.0, "not_logged": 0.0}
    assert one.fix_share == pytest.approx(1.0) and one.missed_epochs == 0
    assert one.losses == () and one.silent_s == 0.0
    assert one.not_logged_s == pytest.approx(30.0, abs=STEP_S)
    assert seconds(one, "3d") == pytest.approx(WHOLE_S - 30.0, abs=2.0 * STEP_S)
    assert found.answer.grade == "good" and found.answer.sentence.startswith("single (3D) throughout")
    assert not [finding for finding in found.findings if finding.severity != "info"]


def test_the_same_silence_that_nothing_explains_stays_a_gap() -> None:
    one = assessed(paused(is_known=False)).answer.receiver
    assert shares(one)["log_silent"] == pytest.approx(30.0 / WHOLE_S, abs=0.005)
    assert one.missed_epochs == 150 and len(one.losses) == 1


@pytest.mark.parametrize(
    ("gap_s", "lost_s"),
    [
        ((90.0, 130.0), (89.8, 100.0)),  # the receiver stopped before the disarm; from row to row
        ((100.0, 140.0), (130.0, 140.0)),  # it came back after the arm
    ],
)
def test_what_the_receiver_misses_beside_a_pause_is_its_own(
    gap_s: tuple[float, float], lost_s: tuple[float, float]
) -> None:
    found = assessed(paused(*gap_s))
    one = found.answer.receiver
    (loss,) = one.losses
    assert loss.state == "no_record" and (loss.start_s, loss.end_s) == pytest.approx(lost_s, abs=STEP_S)
    assert one.missed_epochs == pytest.approx(50, abs=1)
    assert shares(one)["no_record"] == pytest.approx(10.0 / (WHOLE_S - 30.0), abs=0.003)
    assert one.fix_share == pytest.approx(1.0 - 10.0 / (WHOLE_S - 30.0), abs=0.003)
    assert seconds(one, "not_logged") == pytest.approx(30.0, abs=2.0 * STEP_S)
    assert "gnss.silent" in [finding.code for finding in found.findings]


@pytest.mark.parametrize(
    ("gap_s", "told"),
    [
        (PAUSE_S, [("good", 0.0, 100.0), ("not logged", 100.0, 130.0), ("good", 130.0, WHOLE_S)]),
        (
            (90.0, 130.0),
            [("good", 0.0, 89.8), ("no GNSS", 89.8, 100.0), ("not logged", 100.0, 130.0), ("good", 130.0, WHOLE_S)],
        ),
        (
            (100.0, 140.0),
            [("good", 0.0, 100.0), ("not logged", 100.0, 130.0), ("no GNSS", 130.0, 140.0), ("good", 140.0, WHOLE_S)],
        ),
    ],
)
def test_the_lane_of_the_overview_is_red_only_where_the_receiver_is_silent(
    gap_s: tuple[float, float], told: list[tuple[str, float, float]]
) -> None:
    lanes = gnss_lanes(paused(*gap_s), 4.0)
    assert lanes is not None
    assert lanes.state.tolist() == [state for state, *_ in told]
    assert lanes.start_s.tolist() == pytest.approx([start_s for _, start_s, _ in told], abs=1e-6)
    assert lanes.end_s.tolist() == pytest.approx([end_s for *_, end_s in told], abs=0.3)


def test_the_lane_without_a_known_pause_is_red() -> None:
    lanes = gnss_lanes(paused(is_known=False), 4.0)
    assert lanes is not None and lanes.state.tolist() == ["good", "no GNSS", "good"]


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"fix": np.where(times() < 60.0, "none", "3d")}, ["no fix", "good"]),
        (
            dict.fromkeys(("latitude_deg", "velocity_north_mps"), np.where(times() < 60.0, np.nan, 1.0)),
            ["no fix", "good"],
        ),
        ({"hdop": np.where(times() < 60.0, np.nan, 0.8)}, ["DOP not logged", "good"]),
        ({"hdop": None, "fix": np.where(times() < 60.0, "none", "3d")}, ["no fix", "DOP not logged"]),
        (
            {"hdop": np.where(times() < 60.0, 99.99, 0.8), "fix": np.where(times() < 60.0, "none", "3d")},
            ["no fix", "good"],
        ),
    ],
)
def test_a_lane_tells_no_fix_from_a_dilution_that_is_not_logged(changed: dict[str, Any], told: list[str]) -> None:
    lanes = gnss_lanes(flight(table(times(), **changed)), 4.0)
    assert lanes is not None and lanes.state.tolist() == told
    assert lanes.start_s.tolist() == pytest.approx([0.0, 60.0], abs=STEP_S)


@pytest.mark.real_log
def test_a_copter_that_logs_nothing_while_disarmed() -> None:
    """ArduCopter 3.6.7 with LOG_DISARMED 0: disarmed at 12:37:09.88, armed again 21.2 s later."""
    opened = open_flight(real_log("dataflash/copter_3.6.7_log0041.BIN"))
    (pause,) = opened.flight.pauses
    assert pause.length_s == pytest.approx(21.2, abs=0.01)
    results = opened.results
    told = [one for one in results.findings if one.code in ("data.not_logged", "data.gaps", "data.silent")]
    assert [(one.code, one.severity) for one in told] == [("data.not_logged", "info")]
    assert min(share for topic, share in results.completeness.items() if is_canonical(topic)) > 0.98
    assert results.status == "degraded"  # its end is cut off
    answer = results.answer(GnssReception)
    assert answer is not None
    one = answer.receiver
    assert one.fix_share == pytest.approx(1.0) and one.missed_epochs == 0 and one.losses == ()
