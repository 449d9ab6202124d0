"""Tables of the study of several units: false alarms, faults found, coverage."""

from collections.abc import Callable, Sequence

import numpy as np

from groundstation.methods.intervals import share_interval
from groundstation.results.figures import FigureData
from groundstation.simulation.ins_units.family import GNSS_MODES, UNIT_NUMBERS
from groundstation.systems.inertial.study.units_runs import CellError, UnitsOutcome

ALL = "all"
SHARE_DIGITS = 3


def _of(outcomes: Sequence[UnitsOutcome], group: str, **chosen: object) -> list[UnitsOutcome]:
    return [
        one
        for one in outcomes
        if one.group == group and all(getattr(one, name) == value for name, value in chosen.items())
    ]


def _rows_table(name: str, rows: Sequence[dict[str, object]], digits: dict[str, int]) -> FigureData:
    names = list(rows[0]) if rows else []
    return FigureData(name, {key: np.array([row[key] for row in rows]) for key in names}, digits)


def _share(outcomes: Sequence[UnitsOutcome], is_so: Callable[[UnitsOutcome], bool]) -> float:
    return float(np.mean([is_so(one) for one in outcomes])) if outcomes else float("nan")


def _with_limits(name: str, inside: int, count: int) -> dict[str, object]:
    low, high = share_interval(inside, count) if count else (float("nan"), float("nan"))
    return {name: inside / count if count else float("nan"), f"{name}_low": low, f"{name}_high": high}


SHARES = dict.fromkeys(
    (
        *("share", "share_low", "share_high", "found", "found_low", "found_high", "named", "wrong", "kind", "one_of"),
        *("called", "told", "inside95", "inside95_low", "inside95_high"),
    ),
    SHARE_DIGITS,
)


def false_alarm_table(outcomes: Sequence[UnitsOutcome], group: str = "healthy") -> FigureData:
    """Return the share of healthy flights that were called faulty: in all, and by cell."""
    healthy = _of(outcomes, group)
    cells: list[tuple[str, list[UnitsOutcome]]] = [(ALL, healthy)]
    cells += [(f"{units} units", [one for one in healthy if one.units == units]) for units in UNIT_NUMBERS]
    cells += [(f"GNSS {mode}", [one for one in healthy if one.mode == mode]) for mode in GNSS_MODES]
    cells += [
        (f"{units} units, GNSS {mode}", [one for one in healthy if one.units == units and one.mode == mode])
        for units in UNIT_NUMBERS
        for mode in GNSS_MODES
    ]
    for name, value in (("class", "ins"), ("route", "route")):
        kinds = sorted({getattr(one, value) for one in healthy})
        cells += [(f"{name} {kind}", [one for one in healthy if getattr(one, value) == kind]) for kind in kinds]
    rows = []
    for name, several in cells:
        alarms = sum(one.is_called for one in several)
        rows.append(
            {"flights_of": name, "flights": len(several), "alarms": alarms}
            | _with_limits("share", alarms, len(several))
        )
    return _rows_table("units_false_alarms", rows, SHARES)


def alarm_list(outcomes: Sequence[UnitsOutcome]) -> FigureData:
    """List the healthy flights that were called faulty, so that each can be flown again."""
    called = [one for one in outcomes if one.group in ("healthy", "broken") and one.is_called]
    rows = [
        {
            "case": one.case or "healthy",
            "run": one.run,
            "units": one.units,
            "gnss": one.mode,
            "ins_class": one.ins,
            "route": one.route,
            "hours": one.hours,
            "kinds": ", ".join(one.kinds),
            "sentence": one.sentence,
        }
        for one in called
    ]
    return _rows_table("units_alarm_list", rows, {"hours": 2})


def fault_table(outcomes: Sequence[UnitsOutcome]) -> FigureData:
    """Return the shares of faults found, named and of the right kind, by size, GNSS and units."""
    faulty = _of(outcomes, "fault")
    cases = list(dict.fromkeys((one.case, one.size) for one in faulty))
    rows = []
    for case, size in cases:
        flown = [one for one in faulty if (one.case, one.size) == (case, size)]
        parts = [(ALL, flown)]
        parts += [(f"GNSS {mode}", [one for one in flown if one.mode == mode]) for mode in GNSS_MODES]
        parts += [(f"{units} units", [one for one in flown if one.units == units]) for units in UNIT_NUMBERS]
        for name, several in parts:
            late = [one.late_s for one in several if np.isfinite(one.late_s)]
            rows.append(
                {"fault": case, "size": size, "flights_of": name, "flights": len(several)}
                | _with_limits("found", sum(one.is_found for one in several), len(several))
                | {
                    "named": _share(several, lambda one: one.is_named),
                    "one_of": _share(several, lambda one: one.is_found and not one.is_named),
                    "wrong": _share(several, lambda one: one.is_wrong),
                    "kind": _share(several, lambda one: one.has_kind),
                    "late_s": float(np.median(late)) if late else float("nan"),
                }
            )
    return _rows_table("units_faults", rows, SHARES | {"late_s": 0})


def bad_input_table(outcomes: Sequence[UnitsOutcome]) -> FigureData:
    """Return the shares of bad inputs that were told, and called a fault."""
    bad = _of(outcomes, "bad")
    rows = []
    for case, size in dict.fromkeys((one.case, one.size) for one in bad):
        several = [one for one in bad if (one.case, one.size) == (case, size)]
        rows.append(
            {
                "input": f"{case} {size}".strip(),
                "flights": len(several),
                "no_answer": sum(one.verdict == "not_assessable" for one in several),
                "told": _share(several, lambda one: one.is_told),
                "called": _share(several, lambda one: one.is_called),
                "named": _share(several, lambda one: one.is_named),
                "wrong": _share(several, lambda one: one.is_wrong),
            }
        )
    return _rows_table("units_bad_inputs", rows, SHARES)


def broken_table(outcomes: Sequence[UnitsOutcome]) -> FigureData:
    """Return false alarms and coverage of the rate where an assumption is broken."""
    rows = []
    for case in dict.fromkeys(one.case for one in _of(outcomes, "broken")):
        several = _of(outcomes, "broken", case=case)
        alarms = sum(one.is_called for one in several)
        rates = [cell for one in several for cell in one.cells if cell.quantity == "rate_fit_nmiph"]
        inside = sum(_is_inside(cell) for cell in rates)
        rows.append(
            {"case": case, "flights": len(several), "alarms": alarms}
            | _with_limits("share", alarms, len(several))
            | {"rates": len(rates)}
            | _with_limits("inside95", inside, len(rates))
        )
    return _rows_table("units_broken", rows, SHARES)


def _is_inside(cell: CellError) -> bool:
    return abs(cell.error) <= cell.half95


def coverage_table(outcomes: Sequence[UnitsOutcome]) -> FigureData:
    """Return the share of truths inside the 95 % interval, for each value of the tables.

    Healthy flights, by GNSS mode and class; of faults the sizes told, of bad inputs the lags. ``mean`` and
    ``spread`` are of the error in half intervals: 0 and 0.51 are honest.
    """
    healthy = _of(outcomes, "healthy")
    parts: list[tuple[str, list[UnitsOutcome]]] = [
        *((f"healthy, GNSS {mode}", [one for one in healthy if one.mode == mode]) for mode in GNSS_MODES),
        *((f"healthy, {ins}", [one for one in healthy if one.ins == ins]) for ins in sorted({o.ins for o in healthy})),
    ]
    faults = [one for one in outcomes if one.group in ("fault", "bad")]
    parts += [
        (f"{case} {size}".strip(), [one for one in faults if (one.case, one.size) == (case, size)])
        for case, size in dict.fromkeys((one.case, one.size) for one in faults)
    ]
    rows = []
    for name, several in parts:
        cells = [cell for one in several for cell in one.cells]
        for quantity in dict.fromkeys(cell.quantity for cell in cells):
            of_it = [cell for cell in cells if cell.quantity == quantity]
            ratio = np.array([cell.error / cell.half95 for cell in of_it if cell.half95 > 0.0])
            rows.append(
                {"flights_of": name, "quantity": quantity, "values": len(of_it)}
                | _with_limits("inside95", sum(_is_inside(cell) for cell in of_it), len(of_it))
                | {
                    "mean": float(np.mean(ratio)) if ratio.size else float("nan"),
                    "spread": float(np.std(ratio)) if ratio.size else float("nan"),
                    "half95_median": float(np.median([cell.half95 for cell in of_it])),
                }
            )
    return _rows_table("units_coverage", rows, SHARES | {"mean": 2, "spread": 2, "half95_median": 3})
