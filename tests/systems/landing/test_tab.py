"""The chapter, the figures and the tab of the approaches: what they show is what the answer holds."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.clock import Clock, StepEntry
from groundstation.chapters.markdown import markdown
from groundstation.chapters.parts import Grid
from groundstation.chapters.wording import sentence
from groundstation.cli.lines import shortened
from groundstation.pipeline.one_flight.line import line_of_results, verdict_first
from groundstation.plots.marks import Curve, Dots
from groundstation.plots.plot import Panel
from groundstation.reports.drawing import Drawing, drawn_by
from groundstation.results.answer import by_analysis
from groundstation.results.flight import FlightResults, Source
from groundstation.results.gates import GateState
from groundstation.simulation.approach import load_approach, simulate_approach
from groundstation.systems import systems
from groundstation.systems.landing.analysis import LANDING
from groundstation.systems.landing.answer import GatePlace, LandingResult, StabilisedAt, StabilityLost
from groundstation.systems.landing.chapter import landing
from groundstation.systems.landing.columns import criteria_not_met
from groundstation.systems.landing.criteria_answer import Place
from groundstation.systems.landing.plots import deviations
from groundstation.systems.landing.stabilised import decide
from groundstation.systems.landing.verdict_answer import verdict_words
from tests.recording_contents import Contents
from tests.systems.landing.test_approaches import EXACT, PLAIN, found, site
from tests.told import PLOTS, write_recording

SCENARIO = load_approach("ils-approach")
FLIGHT = simulate_approach(SCENARIO).flight


def results(with_site: bool) -> FlightResults:
    answer = found(FLIGHT, site(SCENARIO) if with_site else None).answer
    source = Source("a.csv", "00" * 32, 0, "flat-csv")
    bare = FlightResults("20260504T060000Z_a", source, {}, FLIGHT.start_ns, FLIGHT.duration_s, "ok")
    return FlightResults(**{**vars(bare), "answers": by_analysis(answer), "figures": answer.figures})


@pytest.fixture(scope="module")
def with_site() -> FlightResults:
    return results(True)


def test_the_chapter_says_what_was_measured_and_what_was_not(with_site: FlightResults) -> None:
    answer = with_site.answer(LandingResult)
    assert answer is not None
    error = answer.approaches[0].position_errors[0]
    section = landing(with_site)
    assert section is not None and error.error_m is not None
    text = markdown(section).replace("\u202f", " ")
    assert f"{error.error_m:+.0f} m across the course" in text
    text = text.replace("\\", "")  # escapes of Markdown
    assert "Accuracy only" in text
    without = landing(results(False))
    assert without is not None and "not measured" in markdown(without)


def claimed(told: FlightResults, **changed: StabilisedAt) -> str:
    """The sentence under the claim, after changes of the last approach by check height: high or low."""
    answer = told.answer(LandingResult)
    assert answer is not None
    one = replace(answer.approaches[-1], stabilised=tuple(changed.values()))
    section = landing(replace(told, answers=by_analysis(replace(answer, approaches=(one,)))))
    assert section is not None and section.claim is not None
    return section.claim.sentences[0].replace("\u202f", " ")


def test_a_verdict_says_what_it_rests_on(with_site: FlightResults) -> None:
    answer = with_site.answer(LandingResult)
    assert answer is not None
    high, low = answer.approaches[-1].stabilised
    states: tuple[GateState, ...] = ("passed", "not_measured", "passed", *["not_measured"] * 4)
    gates = tuple(replace(one, state=state) for one, state in zip(low.gates, states, strict=True))
    partly = replace(low, gates=gates, verdict=decide(gates))
    empty = tuple(replace(one, state="not_measured") for one in high.gates)
    said = claimed(with_site, high=replace(high, gates=empty, verdict=decide(empty)), low=partly)
    assert said == (
        "Stabilised from 152 m (500 ft): 2 held, 5 not judged. "
        "Not measured from 305 m (1000 ft), no criterion is in the log."
    )
    reason = "the straight final begins at 200 m"
    failed = tuple(replace(one, state="failed", value=9.3) if one.name == "bank" else one for one in gates)
    not_stabilised = replace(
        low, gates=failed, verdict=decide(failed), places=(GatePlace("bank", Place(1000.0), "left"),)
    )
    unmeasured = StabilisedAt(high.height_m, "not measured", None, (), reason)
    said = claimed(
        with_site,
        high=unmeasured,
        low=replace(not_stabilised, lost=StabilityLost(152.4, 1000.0, "bank", is_from_the_start=True)),
    )
    rest, counts = f" Not measured from 305 m (1000 ft), {reason}.", "1 failed, 2 held, 4 not judged"
    assert said == f"Outside limits at 152 m (500 ft), bank up to 9.3° left: {counts}.{rest}"
    left = replace(not_stabilised, lost=StabilityLost(83.8, 1010.0, "bank", is_from_the_start=False))
    said = claimed(with_site, high=unmeasured, low=left)
    assert said == f"Within limits at 152 m (500 ft), left at 84 m (275 ft), bank up to 9.3° left: {counts}.{rest}"


@pytest.mark.parametrize(("above_path_m", "side"), [(120.0, "high"), (-60.0, "low")])
def test_terminal_findings_page_and_table_say_one_thing_with_its_side(above_path_m: float, side: str) -> None:
    flown = replace(PLAIN, flown=replace(PLAIN.flown, above_path_m=above_path_m), recorded=EXACT)
    flight, where = simulate_approach(flown).flight, site(flown)
    run = found(flight, where, established_vertical_dots=2.0)
    (one,) = run.answer.approaches
    told = "; ".join(verdict_words(one.stabilised))
    assert re.search(rf"glide path up to \d\.\d dots {side}(, .*)?: \d failed, \d held, \d not judged", told)
    counts = re.findall(r"\d (?:failed|held|not judged)", told.split("; ")[0])
    line = LANDING.sentence(by_analysis(run.answer))
    assert f"glide path up to {told.split('glide path up to ')[1].split(',')[0].split(':')[0]}" in line
    assert re.findall(r"\d (?:failed|held|not judged)", line) == counts
    assert f"vertical_{side}" in criteria_not_met(one).split()
    (finding,) = (finding for finding in run.findings if finding.code == "landing.not_stabilised")
    assert finding.text == f"approach 1 not stabilised: {told}"
    section = landing(replace(results(True), answers=by_analysis(run.answer), figures=run.answer.figures))
    assert section is not None and section.claim is not None
    assert section.claim.sentences[0] == " ".join(sentence(part) for part in verdict_words(one.stabilised))
    grids = [part for part in section.parts if isinstance(part, Grid) and "not stabilised" in part.title]
    values = [str(row[2]) for grid in grids for row in grid.rows if row[1] == "Glide path deviation"]
    assert values and all(value.endswith(f"dots {side}") for value in values)
    sides = {place.side for at in one.stabilised for place in at.places if place.name == "vertical"}
    assert sides == {side} == {at.lost.side for at in one.stabilised if at.lost is not None}


STEP = StepEntry(
    kind="backward", mistake="", record_index=24, records_before=18, set_s=-4.0, shift_of_earlier_s=-4.0, size_s=-3.0
)


def test_a_line_of_the_terminal_has_room_for_counts_and_further_approaches(with_site: FlightResults) -> None:
    answer = with_site.answer(LandingResult)
    assert answer is not None
    landed = answer.approaches[-1]
    (high, low), name = landed.stabilised, f"runway {landed.runway.name}"
    path = replace(low.gates[0], title="glide path deviation", unit="dots", state="failed", value=1.43, name="vertical")
    gates = (path, *(replace(one, state="passed") for one in low.gates[1:]))
    places = (GatePlace("vertical", Place(1000.0), "high"),)
    lost = StabilityLost(83.8, 1010.0, "glide path deviation", False, "high")
    bad = [replace(one, verdict="not stabilised", gates=gates, places=places, lost=lost) for one in (high, low)]
    good = tuple(replace(one, verdict="stabilised") for one in (high, low))
    around = replace(landed, outcome="go-around", touchdown=None, stabilised=good)
    again = replace(landed, outcome="touch-and-go", stabilised=tuple(bad))
    approaches = (around, again, again, replace(landed, stabilised=tuple(bad)))
    line = LANDING.sentence(by_analysis(replace(answer, approaches=approaches)))
    last = verdict_first("Not stabilised", line)
    held = f"{len(gates) - 1} held; go-around {name} stabilised; 2 touch-and-goes {name} not stabilised"
    failed = "1 failed (from 84 m: glide path up to 1.4 dots high)"
    assert landed.touchdown is not None and landed.touchdown.time_utc is not None
    down = f"touchdown {landed.touchdown.time_utc[11:19]}Z"
    assert last == f"not stabilised: landing {name}: {failed}, {held}; {down}"
    narrow = shortened(last, len(last) - 10)
    assert narrow == last.replace(" (from 84 m: glide path up to 1.4 dots high)", "")
    told = LANDING.sentence(by_analysis(replace(answer, approaches=(replace(landed, stabilised=good),))))
    assert told.startswith(f"landing {name} stabilised from 305 m (1000 ft): ") and told.endswith(f"; {down}")
    without_utc = replace(landed, stabilised=good, touchdown=replace(landed.touchdown, time_utc=None, time_s=2674.4))
    told = LANDING.sentence(by_analysis(replace(answer, approaches=(without_utc,))))
    assert told.endswith("; touchdown 44:34")
    only = by_analysis(replace(answer, approaches=(without_utc,)))
    stepped = replace(with_site, answers=only, clock=Clock(steps=(STEP,)))
    assert line_of_results(stepped, systems()).startswith(f"{verdict_first('Stabilised', told)}; clock step -3 s")
    section = landing(stepped)
    assert section is not None and section.headline.endswith(": stabilised, touchdown 44:34")


def test_limits_on_the_page_are_those_of_the_settings(with_site: FlightResults) -> None:
    answer = with_site.answer(LandingResult)
    assert answer is not None
    other = {**answer.settings, "gate_floor_m": 45.0, "established_lateral_dots": 0.75}
    section = landing(replace(with_site, answers=by_analysis(replace(answer, settings=other))))
    assert section is not None
    text = markdown(section).replace("\u202f", " ")
    assert "down to 45 m" in text and "within 0.75 dot of the course and 1 dot of the path" in text


@pytest.mark.parametrize(("along_m", "across_m"), [(-300.0, 150.0), (400.0, -80.0)])
def test_the_figure_of_deviations_says_by_how_much_its_dots_are_off_the_line(along_m: float, across_m: float) -> None:
    scenario = replace(PLAIN, recorded=replace(EXACT, along_m=along_m, across_m=across_m))
    answer = found(simulate_approach(scenario).flight, site(scenario)).answer
    told = replace(results(True), answers=by_analysis(answer), figures=answer.figures)
    plot = deviations(told, "1")
    assert plot is not None
    lateral, vertical = (row.panels[0] for row in plot.rows)

    def apart_m(panel: Panel) -> float:
        """Dots less the line, near the threshold."""
        (dots,) = (mark for mark in panel.marks if isinstance(mark, Dots))
        (line,) = (mark for mark in panel.marks if isinstance(mark, Curve))
        near = (np.asarray(dots.x) > 0.0) & (np.asarray(dots.x) < 1.0)
        return float(np.nanmedian((np.asarray(dots.y) - np.asarray(line.y))[near]))

    told = re.search(
        r"(\d+) m (left|right) of where .* and (\d+) m (ahead|behind).* by ([−+]\d+) m at the threshold",
        plot.caption.replace("\u202f", " "),
    )
    assert told is not None
    assert told[2] == ("right" if across_m > 0.0 else "left") and told[4] == ("ahead" if along_m > 0.0 else "behind")
    assert float(told[1]) == pytest.approx(abs(across_m), abs=5.0)
    assert apart_m(lateral) == pytest.approx(across_m, abs=5.0)
    assert float(told[3]) == pytest.approx(abs(along_m), abs=100.0), (
        "the antenna's height is some 60 m along the course"
    )
    found_height = float(told[5].replace("−", "-"))
    assert apart_m(vertical) == pytest.approx(found_height, abs=5.0), "the height of the antenna is 3 m of it"


def test_every_figure_is_drawn(with_site: FlightResults) -> None:
    section = landing(with_site)
    assert section is not None
    drawn = [part for part in drawn_by(PLOTS, section, with_site).parts if isinstance(part, Drawing)]
    assert [one.title for one in drawn] == [
        "Approach 1: deviations",
        "Approach 1: the final",
        "Approach 1: on the runway",
    ]
    assert all("nan" not in one.svg for one in drawn)


def test_the_tab_shows_the_samples_of_the_answer(with_site: FlightResults, tmp_path: Path) -> None:
    write_recording(tmp_path / "flight.rrd", FLIGHT, with_site)
    contents = Contents(tmp_path / "flight.rrd")
    answer = with_site.answer(LandingResult)
    assert answer is not None
    path, chart = answer.figures[0], "/landing/1/motion/1/sink_rate__m_s__and_bank"
    cursor_s = np.sort(contents.times(f"{chart}/cursor")) / 1e9
    assert cursor_s[0] == pytest.approx(path["time_s"][0]), "the time axis is that of the approach alone"
    assert cursor_s[-2] == pytest.approx(path["time_s"][-1]) and len(contents.fixed[f"{chart}/00_curve"]) == 1
    moved = [row for entity, rows in contents.batches.items() if "right_of_the_course" in entity for row in rows]
    assert 20 < sum(batch.num_rows for batch in moved) <= np.isfinite(path["lateral_guidance_m"]).sum()
    corridors = {f"/landing/1/space/corridor/{name}" for name in ("CAT_I", "CAT_II_and_IIIA", "CAT_IIIB")}
    assert corridors | {"/landing/1/space/positions", "/landing/1/space/guidance"} <= set(contents.fixed)
    assert "/landing/1/space/aircraft" in contents.batches
