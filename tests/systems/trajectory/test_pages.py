"""Chapter, figures and tab of made answers in every state: what is told first, and what is not told."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from groundstation.chapters.markdown import markdown
from groundstation.chapters.parts import Figure, Grid, Mark, Note, Rank, Section
from groundstation.plots.plot import Plot
from groundstation.results.files import load, save
from groundstation.results.flight import FlightResults, NotAssessable
from groundstation.results.manifest import Manifest
from groundstation.results.schema import summary_schema
from groundstation.systems.system import Systems
from groundstation.systems.trajectory.analysis import TRAJECTORY
from groundstation.systems.trajectory.answer import BestTrajectory, TrajectoryParameter, UnitMounting
from groundstation.systems.trajectory.chapter import trajectory
from groundstation.systems.trajectory.onboard_answer import ChangeOfConstant, OnboardErrors, WrongSpan
from groundstation.systems.trajectory.plots import PLOTS
from groundstation.systems.trajectory.system import SYSTEM
from groundstation.systems.trajectory.wording_answer import sentence_of
from groundstation.viewer.recording import write_recording
from tests.recording_contents import Contents
from tests.systems.trajectory.made import onboard, track
from tests.systems.trajectory.made_answers import MADE, accepted, ambiguous, doubtful, results_of, short, without_filter

ANSWERS = {name: make() for name, make in MADE.items()}


def section_of(answer: BestTrajectory) -> Section:
    """The chapter, which must be there with a claim."""
    found = trajectory(results_of(answer))
    assert found is not None and found.claim is not None
    return found


def notes(section: Section) -> list[str]:
    """Texts of the notes that stand before the first table."""
    before = []
    for part in section.parts:
        if not isinstance(part, Note):
            break
        before.append(part.text)
    return before


def grid(section: Section, title: str) -> Grid:
    """The table whose title begins so."""
    return next(one for one in section.parts if isinstance(one, Grid) and one.title.startswith(title))


def plots(results: FlightResults) -> Iterator[tuple[str, Plot]]:
    """Every figure that there is."""
    for name, tell in PLOTS.items():
        plot = tell(results)
        if plot is not None:
            yield name, plot


def test_a_filter_that_is_wrong_opens_the_report() -> None:
    section = section_of(ANSWERS["accepted"])
    claim = section.claim
    assert claim is not None and claim.rank == Rank.ONBOARD_ERROR and claim.mark.text == "Filter wrong"
    assert claim.headline == "On-board heading wrong by 2.10 ± 0.19° from 6:36 on (95 %)"
    assert claim.value == "2.10 ± 0.19°" and not claim.is_danger
    assert notes(section)[0] == "On-board heading wrong by 2.10 ± 0.19° from 6:36 on (95 %)."
    assert "Best trajectory: heading to 0.3°, tilt to 0.10°, position to 0.6 m (95 %)." in claim.sentences


def test_a_filter_that_is_far_off_is_danger_and_a_start_is_not() -> None:
    far = section_of(accepted(heading_error_deg=25.0)).claim
    assert far is not None and far.is_danger
    answer = accepted(heading_error_deg=0.0)
    assert answer.onboard is not None
    row = replace(answer.onboard.rows[0], spans=(WrongSpan(1.0, 20.0, 25.0, 1.0, 40.0),))
    begun = replace(answer, onboard=replace(answer.onboard, rows=(row, *answer.onboard.rows[1:])))
    claim = section_of(begun).claim
    assert claim is not None and claim.rank == Rank.ONBOARD_ERROR and not claim.is_danger


def test_a_small_error_is_told_in_the_chapter_and_does_not_open_the_report() -> None:
    section = section_of(accepted(heading_error_deg=1.0))
    assert section.claim is not None and section.claim.rank == Rank.TRACK
    assert section.claim.headline.startswith("Heading to 0.3°, tilt to 0.10°, position to 0.6 m (95 %)")
    assert notes(section)[0].startswith("On-board heading wrong by 1.00 ± 0.19° from 6:36 on")


def test_a_doubtful_solution_says_so_first_and_blames_nobody() -> None:
    section = section_of(doubtful())
    assert section.claim is not None and section.claim.mark.text == "Doubtful" and section.claim.rank == Rank.TRACK_OPEN
    assert section.claim.headline.startswith("Sigmas may be too small: innovations of GNSS velocity are 2.4 times")
    assert notes(section)[0].startswith("Do not build on the sigmas")
    assert not any("wrong by" in text for text in notes(section)) and not section.claim.figures
    told = grid(section, "Errors of the on-board filter")
    assert {row[-1] for row in told.rows} == {"—"} and "not told" in told.caption
    marks = [row[-1] for row in grid(section, "Checks").rows]
    assert any(getattr(mark, "text", "") == "outside" for mark in marks)


def test_an_ambiguous_heading_shows_both_and_claims_neither() -> None:
    section = section_of(ambiguous())
    assert section.headline.startswith("two headings explain the log, 312 or 107° at the end")
    rows = grid(section, "Hypotheses").rows
    assert [row[1] for row in rows] == ["40.0°", "195.0°"] and rows[1][3] == "3.2"
    assert not any(row[0] == "Heading" for row in grid(section, "Accuracy").rows)
    names = [
        mark.name for _name, plot in plots(results_of(ambiguous())) for panel in plot.panels for mark in panel.marks
    ]
    assert "second hypothesis" in names


def test_without_a_filter_on_board_nothing_is_said_of_it() -> None:
    section = section_of(without_filter())
    assert "on-board" not in markdown(section).lower().replace("best trajectory", "")
    assert PLOTS["trajectory.onboard_attitude"](results_of(without_filter())) is None
    assert section.claim is not None and section.claim.rank == Rank.TRACK


def test_a_filter_that_is_right_is_said_to_be() -> None:
    section = section_of(ANSWERS["hover"])
    assert notes(section)[0].startswith(
        "The on-board filter is nowhere wrong beyond 95 % for two seconds; it differs by heading 0.0"
    )
    assert {getattr(row[-1], "text", "") for row in grid(section, "Errors of the on-board").rows} == {"nowhere"}


def test_a_minute_has_no_outage_and_no_empty_table() -> None:
    section = section_of(short())
    assert all(part.rows for part in (*section.parts, *section.appendix) if isinstance(part, Grid))
    assert PLOTS["trajectory.outages"](results_of(short())) is None
    assert section.claim is not None and not any("Outage" in label for label, *_rest in section.claim.figures)


@pytest.mark.parametrize("name", ANSWERS)
def test_every_figure_of_the_chapter_is_described_and_its_axes_have_units(name: str) -> None:
    results = results_of(ANSWERS[name])
    section = trajectory(results)
    assert section is not None
    shown = {part.name for part in (*section.parts, *section.appendix) if isinstance(part, Figure)}
    assert shown == set(PLOTS)
    for figure, plot in plots(results):
        assert plot.name == figure
        for panel in plot.panels:
            assert ", " in panel.y.title and plot.numbers, figure


def test_a_gap_breaks_the_lines_and_the_page_tells_of_two_segments() -> None:
    results = results_of(ANSWERS["gapped"])
    plot = PLOTS["trajectory.sigmas"](results)
    assert plot is not None
    curve = plot.panels[0].marks[0]
    assert np.isnan(curve.y).sum() == 1  # type: ignore[union-attr]
    assert "2 segments" in markdown(section_with_appendix(results))


def section_with_appendix(results: FlightResults) -> Section:
    """The chapter with the parts that only a report shows."""
    section = trajectory(results)
    assert section is not None
    return replace(section, parts=(*section.parts, *section.appendix))


def test_what_was_not_assessed_says_why() -> None:
    reason = NotAssessable("trajectory", "point samples at 10 Hz in motion, at least 25 Hz are needed")
    section = trajectory(replace(results_of(short()), answers={}, not_assessable=(reason,)))
    assert section is not None and "point samples at 10 Hz" in markdown(section)
    assert trajectory(replace(results_of(short()), answers={}, not_assessable=())) is None


@pytest.mark.parametrize("name", ANSWERS)
def test_an_answer_comes_back_as_it_was_saved(name: str, tmp_path: Path) -> None:
    answer = ANSWERS[name]
    save(tmp_path / "a", results_of(answer), Manifest())
    found = load(tmp_path / "a", {"trajectory": BestTrajectory}).results
    back = found.answer(BestTrajectory)
    assert back is not None and sentence_of(back) == sentence_of(answer)
    assert [one.quantity for one in back.accuracy] == [one.quantity for one in answer.accuracy]
    assert back.onboard is None or isinstance(back.onboard, OnboardErrors)
    assert trajectory(found) is not None


@pytest.mark.parametrize("name", ANSWERS)
def test_what_is_saved_obeys_the_schema_of_its_types(name: str, tmp_path: Path) -> None:
    save(tmp_path / "a", results_of(ANSWERS[name]), Manifest())
    saved = json.loads((tmp_path / "a" / "summary.json").read_text(encoding="utf-8"))
    schema = summary_schema({"trajectory": BestTrajectory})
    jsonschema.Draft202012Validator(schema).validate(saved)
    saved["results"]["trajectory"]["outages"] = [{"length_s": -1.0}]
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(schema).validate(saved)


@pytest.mark.parametrize("name", ["accepted", "ambiguous", "without_filter", "short"])
def test_the_tab_has_both_tracks_and_every_page(name: str, tmp_path: Path) -> None:
    write_recording(tmp_path / "a.rrd", onboard(track(60.0)), results_of(ANSWERS[name]), Systems((SYSTEM,)))
    contents = Contents(tmp_path / "a.rrd")
    assert "/trajectory/space/smoothed" in contents.fixed and "/trajectory/space/smoothed_nose" in contents.batches
    has_filter = ANSWERS[name].onboard is not None
    assert ("/trajectory/space/onboard" in contents.fixed) == has_filter
    assert ("/trajectory/space/onboard_nose" in contents.batches) == has_filter
    assert any(path.startswith("/trajectory/onboard_attitude") for path in contents.batches) == has_filter
    text = contents.text("/trajectory/answer").replace("\\", "")
    assert sentence_of(ANSWERS[name]).split(" ")[0] in text


def test_the_line_on_the_terminal_says_whose_attitude_it_is_where_it_is_not_the_vehicles() -> None:
    made = without_filter()
    turned = UnitMounting("found", "", off_deg=9.0, to_state_deg=(0.7, 7.3, 185.3))
    line = TRAJECTORY.sentence
    assert line({"trajectory": made}).startswith("heading to ")
    told = line({"trajectory": replace(made, mounting=turned)})
    assert told.startswith("attitude of the unit, 9.0 deg off the vehicle's: heading to ")
    told = line({"trajectory": replace(made, mounting=UnitMounting("case", ""))})
    assert told.startswith("attitude of the unit's case, not of the vehicle: heading to ")
    in_doubt = replace(doubtful(), mounting=turned)
    assert line({"trajectory": in_doubt}).startswith("sigmas may be too small")


def test_what_is_not_observable_has_no_value_and_one_far_from_what_was_assumed_is_told_as_coupled() -> None:
    scale = TrajectoryParameter("accelerometer scale z", "accelerometer scale", "%", 17.1, 0.82, 1.2, False)
    hidden = replace(scale, name="gyro scale x", value=1.6)
    late = replace(scale, name="GNSS latency", group="latency", unit="s", value=5.0, sigma=1.5, start_sigma=2.0)
    made = replace(without_filter(), parameters=(scale, hidden, late))
    found = grid(section_of(made), "Parameters found")
    assert found.rows[0][1:3] == ("17.1 ± 1.6%", "± 2.4%") and found.rows[0][3] == Mark("warn", "not by itself")
    assert found.rows[1][1:] == ("—", "± 2.4%", Mark("unknown", "no"))
    assert not late.is_far and "a sum with others" in found.caption and "no value is told" in found.caption
    assert "a sum with others" not in grid(section_of(replace(made, parameters=(hidden,))), "Parameters").caption


def test_a_filter_that_changed_opens_the_report_without_a_wrong_span() -> None:
    made = accepted()
    assert made.onboard is not None
    rows = tuple(
        replace(one, spans=(), changes=(ChangeOfConstant(396.0, 2.1, 0.2),)) if one.quantity == "heading" else one
        for one in made.onboard.rows
    )
    answer = replace(made, onboard=replace(made.onboard, rows=rows))
    section = section_of(answer)
    told = "On-board heading changed by 2.1 ± 0.2° at 6:36 (95 %): wrong before or after, which cannot be told"
    assert section.claim is not None and section.claim.headline == told
    assert section.claim.mark.text == "Filter changed"
    (row,) = [one for one in grid(section, "Errors of the on-board").rows if one[0] == "Heading"]
    assert "changed by 2.1" in getattr(row[-1], "text", "") and "nowhere" not in getattr(row[-1], "text", "")
    assert any(note.startswith("On-board heading changed") for note in notes(section))


def test_filters_stand_beside_each_other_with_the_one_that_flew_first() -> None:
    made = accepted()
    assert made.onboard is not None
    first = replace(made.onboard, name="EKF3", flew=True, flew_source="AHRS_EKF_TYPE = 3")
    other = replace(made.onboard, topic="ins.2", name="AHR2", flew=False)
    section = section_of(replace(made, onboard=first, other_filters=(other,)))
    shown = grid(section, "All filters of the log")
    assert [row[:2] for row in shown.rows] == [("ins, EKF3", "yes"), ("ins.2, AHR2", "no")]
    assert "heading" in str(shown.rows[0][-1])
    assert "It flew the vehicle (AHRS_EKF_TYPE = 3)" in grid(section, "Errors of the on-board").caption
    assert not [part for part in section_of(made).parts if getattr(part, "title", "") == "All filters of the log"]
