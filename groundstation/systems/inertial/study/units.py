"""Monte Carlo study of several units of one flight.

False alarms, faults found, coverage of every interval, broken assumptions.
"""

import time

from groundstation.chapters.parts import Section
from groundstation.results.figures import FigureData
from groundstation.systems.inertial.study.units_runs import Progress, UnitsOutcome, run_units, units_cases
from groundstation.systems.inertial.study.units_tables import (
    alarm_list,
    bad_input_table,
    broken_table,
    coverage_table,
    false_alarm_table,
    fault_table,
)
from groundstation.systems.study import RunStore, StudyResult, section, table

MOST_ALARMS = 0.05  # share of healthy flights that may be called faulty


def study_units(
    runs: int = 200,
    seed: int = 71,
    progress: Progress | None = None,
    *,
    kept: RunStore[UnitsOutcome] | None = None,
    minutes: float | None = None,
) -> StudyResult:
    """Fly and judge the family of docs/evidence/units.md.

    Parameters
    ----------
    runs : int
        Healthy flights; of each fault there are 0.12, of each bad input 0.06, of each broken assumption 0.21 times as
        many.
    seed : int
        Family seeds are ``60 000 + 10 seed`` and the next one.
    progress : callable, optional
        Called with one line for each flight.
    kept : RunStore, optional
        Flights that it has are taken from there; those that are made are put there.
    minutes : float, optional
        Ends the study early: the tables are those of the flights made.
    """
    end_s = time.monotonic() + 60.0 * minutes if minutes is not None else float("inf")
    cases = units_cases(runs, seed)
    outcomes = run_units(cases, progress, kept=kept, is_over=lambda: time.monotonic() > end_s)
    found = (
        false_alarm_table(outcomes),
        fault_table(outcomes),
        bad_input_table(outcomes),
        coverage_table(outcomes),
        broken_table(outcomes),
        alarm_list(outcomes),
    )
    planned = sum(case.flights for case in cases)
    head = section(
        "Study: several INS units of one flight",
        f"{len(outcomes)} of {planned} flights of docs/evidence/units.md, seeds {cases[0].seed} and {cases[-1].seed}. "
        "A flight is called faulty where the verdict is off or one_of.",
    )
    return StudyResult("units", tuple(one for one in found if len(one)), (head, *_sections(*found)))


def _sections(
    alarms: FigureData,
    faults: FigureData,
    bad: FigureData,
    coverage: FigureData,
    broken: FigureData,
    listed: FigureData,
) -> tuple[Section, ...]:
    share, low, high = (float(alarms[name][0]) for name in ("share", "share_low", "share_high"))
    verdict = "within" if share <= MOST_ALARMS else "above"
    return (
        section(
            "False alarms",
            f"{alarms['alarms'][0]} of {alarms['flights'][0]} healthy flights are called faulty: {100 * share:.1f} % "
            f"({100 * low:.1f} to {100 * high:.1f} %), {verdict} the {100 * MOST_ALARMS:.0f} % asked.",
            table(alarms),
        ),
        section(
            "Faults",
            "found: the faulty unit is named, alone or as one of two; named: it alone; one_of: found, not named alone; "
            "wrong: others are named and it is not; kind: the kind told of it is right; late_s: median of the begin "
            "told less the true one.",
            table(faults),
        ),
        section(
            "Bad inputs",
            "told: recognised as what it is; called: some unit is called faulty; named: the unit with the input; "
            "wrong: another one.",
            table(bad),
        ),
        section(
            "Coverage of the intervals",
            "inside95: share of true values inside the 95 % interval; the truth is the same figure with the true "
            "motion in place of GNSS, of lags and steps what was simulated. mean, spread: of the error over half of "
            "the interval, 0 and 0.51 where the interval is honest.",
            table(coverage),
        ),
        section("Assumptions broken", "Healthy units; shares as above.", table(broken)),
        section("Flights called faulty", *([table(listed)] if len(listed) else ["None."])),
    )
