"""What the chapters of a flight say: front, heading, overview, quality, findings, provenance."""

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from groundstation.base.clock import Clock
from groundstation.base.findings import Finding
from groundstation.base.ledger import DamageEntry, GapDefinition, Ledger, RemarkEntry
from groundstation.chapters.findings import findings
from groundstation.chapters.gates import gate_grid, limit_text
from groundstation.chapters.overview import overview
from groundstation.chapters.parts import Facts, Figure, Grid, Mark, Note, Part, Section
from groundstation.chapters.provenance import provenance
from groundstation.chapters.quality import quality
from groundstation.reports.drawing import Drawing, drawn_by
from groundstation.results.arrays.flight import LedgerRows
from groundstation.results.chosen import ChosenInterval
from groundstation.results.flight import FlightResults, NotAssessable, Source
from groundstation.results.gates import Gate
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.chapter import heading
from groundstation.systems.heading.claim_chapter import claim
from groundstation.systems.latency.answer import Latencies, Latency
from tests.figure_arrays import filled
from tests.report_example import example, heading_result
from tests.systems.inertial.example import forecast_result, inertial_result
from tests.test_recorded import topic
from tests.told import PLOTS, front, next_steps

BARE = FlightResults("NOTIME_00000000", Source("a.csv", "00" * 32, 0, "flat-csv"), {}, None, 0.0, "failed")


def grid(section: Section, title: str) -> Grid:
    return next(part for part in (*section.parts, *section.appendix) if isinstance(part, Grid) and part.title == title)


def facts(parts: Sequence[Part], title: str) -> dict[str, tuple[str, str]]:
    found = next(part for part in parts if isinstance(part, Facts) and part.title == title)
    return {
        label: (value.replace("\u202f", " "), remark.replace("\u202f", " ")) for label, value, remark in found.pairs
    }


def notes(parts: Sequence[Part]) -> list[str]:
    return [part.text for part in parts if isinstance(part, Note)]


def latency_result(**changes: Any) -> Latencies:
    """One pair of sensors, observed where not said otherwise."""
    values: dict[str, Any] = {"state": "observed", "reason": "turns", "latency_s": 0.12, "confidence95_s": (0.1, 0.14)}
    return Latencies((Latency("ins", "gnss", "velocity", **values | changes),))


# ----------------------------------------------------------------------------------------------------- front


def test_front_tells_flight_verdict_and_number_to_type() -> None:
    told = front(example(heading_result()))
    assert told.title == "A12 · flight 17"
    assert told.verdict == Mark("good", "Accept")
    assert told.headline == "Enter −1.05°" and told.to_sign
    assert told.sentences[0] == "Every required gate passed."
    assert told.sentences[1].startswith("INS heading reads too high by 1.04°")
    assert told.sentences[-1] == "Failed, but does not decide: Excess kurtosis 2.4 (wanted −1.2 … 2)."
    assert (told.subject, told.key) == ("Heading correction", "heading")
    pairs = dict(told.pairs)
    assert pairs["Start"] == "2026-05-04 06:00:00 UTC"
    assert pairs["Status"] == Mark("good", "ok") and pairs["Findings"] == "1 warn · 2 info"
    values = {label: (value, remark) for label, value, remark in told.figures}
    assert values["Heading error"] == ("+1.038°", "95 % interval +0.977° … +1.099°")
    assert values["Parking heading, corrected"][0] == "301.98°"
    assert values["Against the reference"][0] == "−3.6′"


def test_advisory_says_how_good_the_number_is_and_gives_none_to_type() -> None:
    reason = "good to +-24 arcmin; taxi the other way. To be entered only where that is enough: -1 deg"
    answer = heading_result(verdict="advisory", confidence95_deg=(0.6, 1.4), verdict_reason=reason)
    found = claim(answer)
    assert found.sentences[0] == "Taxi the other way.", "the headline says how good"
    assert found.mark == Mark("warn", "Advisory")
    assert found.headline == "Good to ± 24′ only: taxi the other way, or state the wind" and not found.to_sign


def test_taxi_after_the_flight_is_never_the_hero() -> None:
    late = Gate("before_take_off", "", 0.5, 1.0, "", "failed", sense="at_least")
    assert claim(heading_result(verdict="reject", gates=(late,))).rank > claim(heading_result()).rank


@pytest.mark.parametrize(
    ("verdict", "mark", "headline"),
    [
        ("reject", Mark("bad", "Reject"), "Enter no correction"),
        ("extend", Mark("warn", "Extend"), "No correction yet: measure longer"),
        ("undecided", Mark("unknown", "Undecided"), "No correction: a required gate was not measured"),
    ],
)
def test_other_verdicts_give_no_number_to_type(verdict: str, mark: Mark, headline: str) -> None:
    results = example(heading_result(verdict=verdict, verdict_reason="a gate says so", correction_deg=None))
    told = front(results)
    assert (told.verdict, told.headline, told.to_sign) == (mark, headline, False)
    assert told.sentences[0] == "A gate says so." and told.sentences[1] == "INS heading reads too high by 1.04°."
    assert heading(results).headline == f"{mark.symbol} {mark.text} · {headline}"


def test_accepted_error_below_half_a_step_needs_nothing_typed() -> None:
    assert "Nothing to enter" in front(example(heading_result(error_deg=-0.011, correction_deg=None))).headline


@pytest.mark.parametrize(
    ("error_deg", "word"),
    [(1.5, "too high by 1.50°"), (-0.4, "too low by 0.40°"), (0.001, "agrees"), (float("nan"), "not be estimated")],
)
def test_words_say_the_sense_of_the_error(error_deg: float, word: str) -> None:
    assert word in front(example(heading_result(error_deg=error_deg))).sentences[1]


def test_flight_without_heading_says_why_on_the_front() -> None:
    told = front(example(None, not_assessable=(NotAssessable("heading", "no GNSS velocity in the log"),)))
    assert (
        told.verdict == Mark("plain", "Recorded") and told.headline == "No signals; nothing lost" and not told.to_sign
    )
    assert told.missing == (("Heading correction", "no GNSS velocity in the log"),)


def test_the_best_answer_stands_first_and_the_others_beside_it() -> None:
    told = front(example(latency_result(), inertial_result(), forecast_result()))
    assert told.subject == "INS errors" and "0.37" in told.headline
    assert [tile.title for tile in told.others] == ["Forecast without GNSS", "Latency between sensors"]
    decided = front(example(inertial_result(), heading_result(verdict="reject")))
    assert decided.subject == "Heading correction" and decided.others[0].title == "INS errors"
    open_ = front(example(heading_result(verdict="undecided"), inertial_result()))
    assert open_.subject == "INS errors" and open_.others[0].claim.mark.text == "Undecided"


def test_an_answer_that_came_to_nothing_is_told_among_what_could_not_be_assessed() -> None:
    told = front(example(latency_result(latency_s=None, state="not_observable")))
    assert told.verdict == Mark("plain", "Recorded")
    assert told.missing[0] == ("Latency between sensors", "not observable for gnss: too little motion")


def test_a_log_without_taxi_says_what_the_method_needs() -> None:
    reason = "no straight taxi: of 986 epochs above 6 m/s before lift-off: not proven ground 986"
    ((_, told),) = front(example(None, not_assessable=(NotAssessable("heading", reason),))).missing
    assert told.endswith("ground contact not proven for 986")


def test_log_without_absolute_time_names_no_date() -> None:
    told = front(example(None, start_utc_ns=None, metadata={}, flight_id="NOTIME_9f9f9f9f"))
    pairs = dict(told.pairs)
    assert told.title == "NOTIME_9f9f9f9f"
    assert pairs["Start"] == "no absolute time"


def test_bare_results_have_a_front_and_chapters() -> None:
    assert dict(front(BARE).pairs)["Status"] == Mark("bad", "failed: nothing could be computed")
    assert findings(BARE).parts == [Note("No warnings.", "good")]
    assert overview(BARE) is None
    assert notes(heading(BARE).parts) == ["Not assessable: the log does not hold what the method needs"]
    assert notes(quality(BARE).parts) == ["Nothing lost, nothing unreadable."]


# --------------------------------------------------------------------------------------------------- heading


def test_heading_begins_with_verdict_and_number_to_type_where_there_is_no_front() -> None:
    section = heading(example(heading_result()))
    told = front(example(heading_result()))
    assert section.headline == "✓ Accept · Enter −1.05°"
    assert notes(section.above) == list(told.sentences)
    assert [part.pairs for part in section.above if isinstance(part, Facts)] == [told.figures]


def test_gates_say_state_limit_and_role() -> None:
    rows = {str(row[1]): row for row in grid(heading(example(heading_result())), "Gates").rows}
    assert rows["Mean GNSS velocity at standstill"][:1] == (Mark("good", "passed"),)
    assert rows["Mean GNSS velocity at standstill"][3:] == ("≤ 0.01\u202fm/s", "")
    assert rows["Straight taxi"][3] == "≥ 20\u202fs" and rows["Skewness"][3] == "−0.5 … 0.5"
    unmeasured = rows["GNSS integrity flag"]
    assert (unmeasured[0], unmeasured[2]) == (Mark("unknown", "not measured"), "—")
    assert unmeasured[4:] == ("informs; no integrity flag in the log",)


@pytest.mark.parametrize(("required", "tone"), [(True, "bad"), (False, "warn")])
def test_a_gate_that_fails_counts_against_an_answer_only_if_it_decides(required: bool, tone: str) -> None:
    gate = Gate("kurtosis", "Excess kurtosis", 2.4, (-1.2, 2.0), "", "failed", required, "heavy tails")
    table = gate_grid((gate,))
    assert table is not None
    ((mark, *_),) = table.rows
    assert isinstance(mark, Mark) and (mark.tone, mark.text) == (tone, "failed")


def test_least_values_are_told_from_largest_ones_even_on_the_limit() -> None:
    ground = Gate("ground", "", 1.0, 1.0, "", "passed", sense="at_least")
    assert limit_text(ground) == "≥ 1"
    assert limit_text(replace(ground, name="ins_mode", value=0.0, limit=0.0, sense="at_most")) == "≤ 0"


def test_estimates_stand_side_by_side() -> None:
    answer = heading_result()
    table = grid(heading(example(answer)), "Estimates")
    assert [row[1] for row in table.rows[:3]] == ["+1.0379°", f"+{answer.paper_error_deg:.4f}°", "—"]
    assert table.rows[0][2] == "+0.977° … +1.099°"
    assert table.caption == "INS topic ins (true heading) against GNSS topic gnss."


def test_the_aircrafts_own_figures_stand_beside_ours() -> None:
    table = grid(heading(example(heading_result())), "Ground result and the aircraft's own")
    rows = {row[0]: row[1:] for row in table.rows}
    assert rows["Heading error"] == ("+1.038°", "+1.020°", "−0.018°")
    assert rows["Correction"] == ("−1.05°", "−1.00°", "")
    assert table.caption == "Status reported by the aircraft: ready."


def test_runway_lever_arm_and_standstill_are_told() -> None:
    section = heading(example(heading_result(latency_used_s=0.1, latency_used_sigma_s=0.01, latency_origin="motion")))
    (runway,) = grid(section, "Runway check").rows
    assert runway == ("12", "119.72°", "120.71°", "+0.990°", "0.050°", "−0.048°")
    arm = facts(section.appendix, "Lever arm, time offset, drift")
    assert arm["Lever arm, antenna ahead of the main gear"] == ("+4.12 m (σ 0.35 m)", "estimated")
    assert arm["GNSS latency removed"] == ("+0.100 s (σ 0.010 s)", "from the motion")
    assert arm["Azimuth drift"][0] == "+0.80 °/h (σ 0.70 °/h)"
    still = facts(section.appendix, "GNSS at standstill")
    assert still["Interval"] == ("0:25 – 0:55", "300 samples")
    assert still["Mean velocity, north / east"][0] == "+0.0031 m/s / −0.0035 m/s"
    assert still["Length of the mean vector"] == ("0.0047 m/s", "gated; 0.97 bound 0.0094 m/s")
    assert still["Parts of the velocity error"][0] == "white 0.040 m/s, correlated 0.020 m/s over 4.1 s"


def test_what_is_unknown_is_an_em_dash() -> None:
    answer = heading_result(lever_arm_m=None, time_offset_s=None, drift_deg_per_h=None, error_deg=float("nan"))
    section = heading(example(answer))
    told = facts(section.appendix, "Lever arm, time offset, drift")
    assert [told[label][0] for label in ("GNSS time offset", "Azimuth drift")] == ["—", "—"]
    assert [told[label][1] for label in ("GNSS time offset", "Azimuth drift")] == ["not observable", "not measured"]
    assert grid(section, "Estimates").rows[0][1] == "—"


def test_segments_stand_in_a_table_where_no_figure_is_drawn() -> None:
    section = heading(example(heading_result()))
    (forest,) = [part for part in section.parts if isinstance(part, Figure) and part.name == "heading.forest"]
    assert isinstance(forest.instead, Grid)
    assert len(forest.instead.rows) == 4
    first = tuple(str(cell).replace("\u202f", " ") for cell in forest.instead.rows[0])
    assert first == ("1:10 – 2:10", "600", "302.0°", "8.9 m/s", "+1.070°", "0.060°")


def test_intervals_chosen_by_hand_are_told_where_they_are_known() -> None:
    chosen = (ChosenInterval("exclude", "+03:10", "+03:15", "towed"), ChosenInterval("force", "1", "2"))
    part = next(
        part
        for part in heading(example(heading_result(), chosen=chosen)).parts
        if isinstance(part, Facts) and part.title == "Intervals chosen by hand"
    )
    assert part.pairs == [
        ("Left out by hand", "+03:10 – +03:15", "towed"),
        ("Used by hand despite the gates", "1 – 2", ""),
    ]
    assert not [one for one in heading(example(heading_result())).parts if getattr(one, "title", "") == part.title]


def test_settings_are_for_the_printed_page() -> None:
    (settings,) = [
        part for part in heading(example(heading_result())).appendix if isinstance(part, Facts) and part.compact
    ]
    assert settings.title == "Settings: [heading]" and ("taxi_speed_min_mps", "6", "") in settings.pairs
    text = "\n".join(f"{name} = {value}" for name, value, _ in settings.pairs)
    assert tomllib.loads(text) == heading_result().settings


def test_a_receiver_that_holds_its_velocity_has_no_flat_lines_at_standstill() -> None:
    still = heading_result().standstill
    assert still is not None
    section = heading(example(heading_result(standstill=replace(still, velocity_is_held=True))))
    assert not [part for part in section.parts if isinstance(part, Figure) and part.name.startswith("standstill")]
    assert notes(section.parts) == ["The receiver holds its velocity at standstill, so its error there cannot be seen."]


def test_every_figure_of_a_chapter_has_a_drawer() -> None:
    results = example(heading_result())
    chapters = [heading(results), overview(results), quality(results)]
    whole = [replace(one, parts=(*one.parts, *one.appendix)) for one in chapters if one]
    named = [part.name for one in whole for part in one.parts if isinstance(part, Figure)]
    assert set(named) <= set(PLOTS) and len(named) == len(set(named)) == 13
    drawn = [part for one in whole for part in drawn_by(PLOTS, one, results).parts if isinstance(part, Drawing)]
    assert len(drawn) == 12, "the example has no spectrum"


# ---------------------------------------------------------------------- quality, findings, provenance, overview


def test_ledger_has_a_row_for_each_topic() -> None:
    table = grid(quality(example(None)), "Topics")
    titles = [head.title for head in table.heads]
    gnss = dict(zip(titles, next(row for row in table.rows if row[0] == "gnss"), strict=True))
    assert gnss["Rows"] == "29\u202f690" and gnss["Rate / nominal, Hz"] == "9.97 / 10"
    assert (gnss["Coverage"], gnss["Longest gap, s"]) == ("99.0%", "28.10")
    assert (gnss["Gaps"], gnss["Duplicates"], gnss["Steps back"]) == ("2", "14", "1")
    assert "Stuck" not in titles, "a ledger without that column counts nothing of it"


def test_a_raw_topic_with_gaps_stands_beside_the_figure_that_shows_them() -> None:
    whole = example(None)
    rows = whole.rows_of(LedgerRows)
    assert rows is not None
    raw = replace(
        rows,
        topic=np.array([*(f"raw.{number}" for number in range(len(rows) - 1)), "gnss"]),
        gaps=np.array([2, *(0 for _ in range(len(rows) - 1))]),
        longest_gap_s=np.array([2.0, *(0.0 for _ in range(len(rows) - 1))]),
    )
    table = grid(quality(replace(whole, figures=(raw,))), "Topics")
    place = [head.title for head in table.heads].index("Longest gap, s")
    assert [(row[0], row[place]) for row in table.rows] == [("gnss", "—"), ("raw.0", "2.00")]


def test_the_table_of_topics_says_what_coverage_and_a_gap_are() -> None:
    ledger = replace(example().ledger, gap_definition=GapDefinition(periods=3.0, min_s=0.2))
    caption = grid(quality(replace(example(), ledger=ledger)), "Topics").caption
    assert "Gap: from sample to sample, longer than 3 periods and 0.2 s; single missing samples" in caption


def test_a_long_ledger_is_cut_and_says_so() -> None:
    count = 70
    ledger = filled("ledger", topic=[f"raw.t{number}" for number in range(count)], rows=[1] * count, stuck=[2] * count)
    table = grid(quality(example(None, figures=(ledger,))), "Topics")
    assert len(table.rows) == 60 and table.caption == "10 more topics in the table file."
    assert table.heads[-1].title == "Stuck" and table.rows[0][-1] == "2"


def test_quality_begins_with_flight_status_and_log_where_there_is_no_front() -> None:
    section = quality(example(None))
    assert section.headline == "20260504T060000Z_A12_17: ok"
    log = facts(section.above, "")
    assert log["Log"] == ("2026-05-04 A12 flight 17.csv", "48 211 902 bytes")
    assert log["SHA-256 of the log"][0] == "9f" * 32


def test_clock_and_ledger_are_told_by_their_fields() -> None:
    flight = example(None, clock=Clock(nominal_period_s=0.02, is_absolute=True), ledger=Ledger(bytes_skipped=7))
    parts = quality(flight).appendix
    clock = facts(parts, "Clock model")
    assert clock["nominal period"][0] == "0.02 s" and clock["is absolute"][0] == "yes"
    ledger = facts(parts, "Ledger of the log")
    assert ledger["bytes skipped"][0] == "7"
    assert not {"topics", "damages", "remarks", "spans", "truncated", "dropouts · count"} & set(ledger)


def test_losses_are_a_table_and_remarks_are_not() -> None:
    what = "bytes of a record"
    damage = DamageEntry(kind="truncated", what=what, topic="", place="byte 9", count=7, loses_data=True)
    remark = RemarkEntry(code="derived", text="told as a finding", topic="ins")
    section = quality(example(None, ledger=Ledger(damages=(damage,), remarks=(remark,))))
    assert grid(section, "Damage to the log").rows == [("truncated", what, "byte 9", "7", "yes")]
    assert "told as a finding" not in str(section)
    assert Note("Nothing lost, nothing unreadable.", "good") in quality(BARE).parts


def test_findings_stand_most_severe_first() -> None:
    found = tuple(Finding(severity, f"a.{severity}", f"text of {severity}") for severity in ("info", "fail", "warn"))
    results = example(None, findings=found)
    section = findings(results)
    rows = grid(section, "Findings").rows
    assert [row[:2] for row in rows] == [(Mark("bad", "fail"), "text of fail"), (Mark("warn", "warn"), "text of warn")]
    (remarks,) = [part for part in section.appendix if isinstance(part, Grid)]
    assert [row[:2] for row in remarks.rows] == [(Mark("plain", "info"), "text of info")]
    assert dict(front(results).pairs)["Findings"] == "1 fail · 1 warn · 1 info"


def test_remarks_on_raw_topics_are_one_line() -> None:
    remarks = [Finding("info", "values.nan", f"raw.t.f{n}: NaN", "raw.t", "", 2) for n in range(50)]
    results = example(None, findings=(*remarks, Finding("warn", "data.truncated", "cut", "", "byte 9", 1)))
    section = findings(results)
    assert grid(section, "Findings").rows == [(Mark("warn", "warn"), "cut", "byte 9", "1")]
    (remarks,) = [part for part in section.appendix if isinstance(part, Grid)]
    joined = "50 fields of raw topics hold NaN as the device wrote it: t"
    assert remarks.rows == [(Mark("plain", "info"), joined, "", "100")]


def test_what_the_front_tells_is_not_told_again_among_the_findings() -> None:
    codes = ("heading.reject", "heading.not_assessable", "landing.not_assessable", "data.gaps")
    section = findings(example(None, findings=tuple(Finding("warn", code, code) for code in codes)))
    assert [row[1] for row in grid(section, "Findings").rows] == ["data.gaps"]


def test_the_findings_counted_on_the_front_are_accounted_for() -> None:
    raw = [Finding("info", "time.duplicates", f"raw.t{n}: repeats", f"raw.t{n}") for n in range(5)]
    above = [Finding("info", f"{one}.not_assessable", "no INS") for one in ("heading", "inertial")]
    others = [Finding("info", "gnss.held", "steps of 1.1 cm"), Finding("warn", "heading.reject", "rejected")]
    results = example(None, findings=(*raw, *above, *others))
    assert dict(front(results).pairs)["Findings"] == "1 warn · 8 info"
    where = "1 warning at the top of the report; 2 remarks at the top of the report"
    assert Note(f"{where}; 6 remarks in the appendix (2 lines, one for each kind).") in findings(results).parts


def test_next_steps_are_at_most_three_lines_by_what_they_are_for() -> None:
    failed = (
        Gate("taxi_seconds", "", 12.0, 20.0, "s", "failed", sense="at_least"),
        Gate("geometry", "", None, 0.9, "", "not_measured", reason="no GDOP, PDOP or HDOP in the log"),
        Gate("skewness", "", 0.9, 0.5, "", "failed"),
        Gate("quality", "", 0.1, 0.3, "", "passed"),
    )
    results = example(heading_result(verdict="extend", gates=failed))
    section = next_steps(results)
    assert section is not None
    (part,) = section.parts
    assert isinstance(part, Facts)
    assert [(label, text.replace("\u202f", " ")) for label, text, _ in part.pairs] == [
        ("Fly", "For the heading correction: taxi straight for 20 s or more before take-off."),
        ("Record", "For the heading correction: GDOP, PDOP or HDOP."),
        ("Check", "For the heading correction: the taxiway for reflections and gusts."),
    ]
    assert next_steps(example(heading_result(gates=()), not_assessable=())) is None


@pytest.mark.parametrize(("field", "is_asked"), [("true_heading_deg", False), ("magnetic_heading_deg", True)])
def test_a_log_without_a_compass_is_not_asked_for_a_magnetometer(field: str, is_asked: bool) -> None:
    missing = (NotAssessable("magnetic", "no three-axis magnetometer in the log"),)
    ledger = Ledger(topics={"ins": topic(10.0, 80.0, field)})
    section = next_steps(example(heading_result(gates=()), ledger=ledger, not_assessable=missing))
    assert ("magnetometer" in str(section)) == is_asked


@pytest.mark.parametrize(
    ("topics", "is_asked"), [(("imu", "gnss"), False), (("gnss",), False), (("ins", "gnss"), True)]
)
def test_what_only_an_ins_gives_is_asked_of_a_log_with_one(topics: tuple[str, ...], is_asked: bool) -> None:
    missing = NotAssessable("heading", "no INS heading in the log"), NotAssessable("inertial", "no INS position in ins")
    ledger = Ledger(topics={name: topic(10.0, 80.0, "latitude_deg") for name in topics})
    section = next_steps(example(heading_result(gates=()), ledger=ledger, not_assessable=missing))
    assert (section is not None) == is_asked and ("INS heading" in str(section)) == is_asked


def test_advice_for_two_answers_is_told_once() -> None:
    missing = tuple(NotAssessable(name, "GNSS never had a fix") for name in ("heading", "trajectory"))
    section = next_steps(example(not_assessable=missing))
    assert section is not None
    (part,) = section.parts
    assert isinstance(part, Facts) and [label for label, _, _ in part.pairs] == ["Check"]
    assert part.pairs[0][1] == (
        "For the heading correction and the best trajectory: the GNSS antenna, its cable and its sky."
    )


def test_provenance_names_log_and_files() -> None:
    section = provenance(example(None))
    files = facts(section.parts, "Source and files")
    assert files["SHA-256 of the log"][0] == "9f" * 32
    assert files["Recording"] == ("20260504T060000Z_A12_17.rrd", "open with: groundstation view")
    assert list(facts(section.parts, "Metadata of the log")) == ["crew"]  # the others stand at the top


def test_long_lists_of_metadata_are_left_to_the_summary() -> None:
    section = provenance(example(None, metadata={"crew": "two", "parameter.X": "1", "units.y": "m", "derived.z": "x"}))
    assert list(facts(section.parts, "Metadata of the log")) == ["crew"]
    assert "summary.json" in notes(section.parts)[0]


def test_overview_stands_where_there_is_something_to_draw() -> None:
    section = overview(example(None))
    assert section is not None
    assert [part.name for part in section.parts if isinstance(part, Figure)] == [
        *("overview.track", "overview.profile", "overview.attitude", "overview.states")
    ]
    answer = example(heading_result()).answer(HeadingResult)
    assert answer is not None and overview(example(answer, figures=answer.figures)) is None


def test_what_a_log_contradicts_itself_in_is_advised_once() -> None:
    found = [Finding("warn", "data.contradiction", "this log contradicts itself: ...", "ins") for _ in range(2)]
    section = next_steps(example(None, findings=tuple(found), not_assessable=()))
    assert section is not None and isinstance(section.parts[0], Facts)
    (text,) = (text for line, text, _ in section.parts[0].pairs if line == "Check")
    assert str(text).count("igns, units and axes of ins") == 1
