"""An aided INS whose errors another answer knows: chapter, sentence and findings tell them, and claim no ignorance."""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from groundstation.base.findings import Finding
from groundstation.chapters.parts import Section
from groundstation.pipeline.one_flight.analyse import run_analyses
from groundstation.results.answer import Answer, by_analysis
from groundstation.results.figures import FigureData
from groundstation.results.roles import ErrorsOfFilter, FilterError, FilterWrong
from groundstation.systems.inertial.analysis import FORECAST, INERTIAL
from groundstation.systems.inertial.answer import Departure, FilterOfIns, InertialResult
from groundstation.systems.inertial.chapter import inertial
from groundstation.systems.inertial.judged_answer import judged_filter
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.known import Known
from groundstation.tables.phases import flight_phases
from tests.report_example import example
from tests.section_contents import every_text, notes
from tests.systems.inertial.example import AIDED, inertial_result
from tests.systems.inertial.flights import batch_of, changed, flight_of

WRONG = FilterWrong((723.0, 1795.0), (0.0, 1800.0), 2.1, 0.3, over=1.2)
SMALL = FilterWrong((100.0, 130.0), (0.0, 1800.0), 0.5, 0.2, over=0.2)
POSITION = FilterError("horizontal position", "m", 0.84, 0.31)


@dataclass(frozen=True)
class Judge(Answer, ErrorsOfFilter):
    """An answer that knows the errors of a filter."""

    analysis: ClassVar[str] = "judge"
    topic: str = "ins"
    wrong: tuple[FilterWrong, ...] = (SMALL, WRONG)
    figures: tuple[FigureData, ...] = ()

    @property
    def filter_topics(self) -> tuple[str, ...]:
        return (self.topic,)

    @property
    def by_it(self) -> str:
        return "by a better unit"

    def filter_errors(self, topic: str) -> tuple[FilterError, ...]:
        if topic != self.topic:
            return ()
        return FilterError("heading", "deg", 1.23, 0.15, self.wrong, "yaw +0.40 deg"), POSITION


def told(judge: Judge, **changes: Any) -> tuple[Section, str]:
    """Chapter and sentence of an aided INS beside an answer that judges it."""
    answer = inertial_result(**{**AIDED, **changes})
    answers = by_analysis(answer, judge)
    section = inertial(replace(example(answer), answers=answers))
    assert section is not None
    return section, INERTIAL.sentence(answers)


def test_a_heading_that_is_surely_wrong_is_the_headline() -> None:
    section, sentence = told(Judge())
    wrong = "judged by a better unit: heading wrong by 2.1 +- 0.3 deg from 12:03 on (95 %)"
    assert sentence == f"INS corrected by GNSS, within 3.0 m of it (95 %); {wrong}"
    assert "heading wrong by 2.1 ± 0.3" in section.headline.replace("\u202f", " ")
    assert section.claim is not None and section.claim.headline == section.headline
    assert (section.claim.mark.tone, section.claim.mark.text) == ("warn", "Filter wrong")
    assert [one[:2] for one in section.claim.figures[1:]] == [
        ("Error, heading", "1.2 °"),
        ("Error, horizontal position", "0.84 m"),
    ]
    assert "yaw" in notes(section)[0] and "no error of the filter" in notes(section)[0]
    unknown = ("nothing is estimated, corrected", "cannot be seen;", "its own drift")
    assert not [text for text in every_text(section) for one in unknown if one in text]


def test_without_a_large_error_the_usual_ones_are_told_with_sigma() -> None:
    section, sentence = told(Judge(wrong=(SMALL,)))
    errors = "heading 1.2 deg (sigma 0.15) and horizontal position 0.8 m (sigma 0.3), RMS"
    assert sentence.endswith(f"; judged by a better unit: {errors}")
    assert section.claim is not None and section.claim.mark.text == "Measured"


def test_a_departure_stays_in_front() -> None:
    left = Departure(1000.0, 1120.0, 181.0, None)
    section, sentence = told(Judge(), departures=(left,), filter_of_ins=FilterOfIns("EKF3"))
    assert sentence.startswith("EKF3 and GNSS up to 181 m apart for 120 s; judged by a better unit: heading wrong")
    assert section.claim is not None and section.claim.is_danger and section.claim.mark.text == "Left GNSS"


def test_errors_of_another_filter_are_not_told() -> None:
    for judge in (Judge("ins.1"), Judge("")):
        answer = inertial_result(**AIDED)
        assert judged_filter(by_analysis(answer, judge), "ins") is None
        section, sentence = told(judge)
        assert sentence == "INS corrected by GNSS, within 3.0 m of it (95 %): no errors, no forecast"
        plain = inertial(example(answer))
        assert plain is not None and every_text(section) == every_text(plain)


def test_findings_and_forecast_tell_what_is_known() -> None:
    flight = replace(flight_of(batch_of()), metadata={"ins_kind": "gnss_aided"})
    gnss = flight["gnss"]
    names = ("latitude_deg", "longitude_deg", "velocity_north_mps", "velocity_east_mps")
    flight = changed(flight, "ins", **{name: gnss.values(name).copy() for name in names})

    def run(*judges: Judge) -> tuple[list[Finding], str]:
        settings = {"inertial": InertialSettings()}
        known = Known(flight_phases(flight), settings=settings, answers=by_analysis(*judges))
        found = run_analyses((INERTIAL, FORECAST), flight, known)
        assert isinstance(found.answers["inertial"], InertialResult)
        return list(found.findings["inertial"]), found.reasons["forecast"]

    findings, forecast = run(Judge())
    assert "is shown, judged by a better unit: heading wrong by 2.1" in findings[0].text
    assert forecast.endswith("its errors are known by a better unit, none grows")
    findings, forecast = run()
    assert findings[0].text.endswith("INS minus GNSS is shown, errors and forecast are not estimated")
    assert forecast.endswith("its errors are not estimated")
