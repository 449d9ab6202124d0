"""Logs joined by file time: how well their clocks agree is told where a trajectory over both shows it."""

import json
from dataclasses import dataclass, replace
from typing import ClassVar

import pytest

from groundstation.base.serial import to_json_exactly
from groundstation.chapters.markdown import markdown
from groundstation.results.answer import Answer
from groundstation.results.flight import FlightResults, Source
from groundstation.results.roles import StatesAlongTheFlight
from groundstation.systems.known import Known
from groundstation.systems.several_logs.analysis import TOGETHER_ANALYSIS
from groundstation.systems.several_logs.answer import JoinedLog, JoinedStretch, Joining, Together
from groundstation.systems.several_logs.chapter import together
from groundstation.systems.several_logs.joined import _findings
from groundstation.systems.several_logs.settings import TwoClocksSettings
from groundstation.tables.phases import Phases
from groundstation.tables.sources import TOGETHER
from groundstation.tables.table import Flight

UNKNOWN = "it is not known how well the clocks agree"


@dataclass(frozen=True)
class Track(Answer, StatesAlongTheFlight):
    """A trajectory that shows a GNSS latency."""

    analysis: ClassVar[str] = "track"
    states_name: ClassVar[str] = "track"
    latency: tuple[float, float] | None = (-0.284, 0.0006)
    gnss: str = "gnss.b"
    holds: bool = True

    @property
    def unit_topic(self) -> str:
        return "imu"

    @property
    def gnss_topic(self) -> str:
        return self.gnss

    @property
    def is_reference(self) -> bool:
        return self.holds

    @property
    def gnss_latency(self) -> tuple[float, float] | None:
        return self.latency


def logs() -> Together:
    """An inertial unit placed by the times of its file, beside a receiver."""
    stretch = JoinedStretch(0.0, 500.0, "file_time", 0.0)
    unit = JoinedLog("", "imu.csv", "0", "csv", 100, "file_time", stretches=(stretch,))
    return Together((unit, JoinedLog("b", "gnss.pos", "1", "pos", 100, "own_clock")))


def told(answer: Together, track: Track | None) -> tuple[str, str, str]:
    """Mark, headline and text of the chapter."""
    answers: dict[str, Answer] = {"together": answer}
    if track is not None:
        answers["track"] = track
    source = Source("imu.csv + gnss.pos", "00" * 32, 0, "")
    results = FlightResults("NOTIME_00000000", source, {}, None, 500.0, "ok", answers=answers)
    section = together(results)
    assert section is not None and section.claim is not None
    return section.claim.mark.tone, section.claim.headline, markdown(section)


def test_the_latency_of_the_trajectory_tells_how_well_the_clocks_agree() -> None:
    state, headline, text = told(logs(), Track())
    assert state == "good" and UNKNOWN not in text
    assert headline == "2 logs by file time: GNSS 0.2840 ± 0.0012 s earlier by the motion, and taken off"
    assert "GNSS times of gnss.pos are 0.2840 ± 0.0012 s earlier than those of imu.csv" in text
    assert "0.284 ± 0.012 s later" in told(logs(), Track((0.284, 0.006)))[1]


@pytest.mark.parametrize(
    "track",
    [None, Track(latency=None), Track(holds=False), Track(gnss="gnss")],
    ids=["no trajectory", "not observable", "doubtful", "both from one log"],
)
def test_it_is_not_known_where_no_trajectory_shows_it(track: Track | None) -> None:
    assert told(logs(), track)[:2] == ("warn", UNKNOWN)


def test_a_third_log_by_file_time_stays_unknown() -> None:
    both = logs()
    other = replace(both.logs[0], label="c", source_name="c.csv")
    assert told(replace(both, logs=(*both.logs, other)), Track())[:2] == ("warn", UNKNOWN)


def warned(track: Track | None) -> list[str]:
    """Texts of the warnings that the analysis gives."""
    flight = Flight({}, {TOGETHER: json.dumps(to_json_exactly(Joining(logs().logs)))})
    answers: dict[str, Answer] = {} if track is None else {"track": track}
    found = TOGETHER_ANALYSIS.run(flight, Known(Phases((), "none"), answers=answers), TwoClocksSettings())
    return [one.text for one in found.findings if one.severity == "warn"]


def test_file_time_is_warned_of_only_where_the_motion_does_not_show_the_clocks() -> None:
    """The finding of the joining warned also of logs whose latency the trajectory told and took off."""
    assert warned(Track()) == []
    (text,) = warned(None)
    assert text == "the times of the files alone place imu.csv: how well the clocks agree is not known"
    assert [one.severity for one in _findings(logs().logs)] == ["info"]
