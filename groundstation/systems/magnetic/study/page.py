"""Page of the magnetic study: questions and results, in sentences from the tables."""

from collections.abc import Sequence

import numpy as np

from groundstation.base.records import BoolArray
from groundstation.chapters.parts import Grid, Section
from groundstation.results.figures import FigureData
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import METHOD_TITLES
from groundstation.systems.magnetic.study.cases import BANK_DEG, CLAIM, PUBLISHED_FIELD_NT, SWEEPS, SWEPT, Sweep
from groundstation.systems.magnetic.study.judge import JUDGED_METHODS, LIMITS, METHODS
from groundstation.systems.magnetic.study.tables import (
    BETTER,
    HELD_OUT,
    IRON,
    POWER_SOURCES,
    TABLE,
    UNDECIDED,
    WORSE,
    rows_where,
)
from groundstation.systems.study import grid, section, table

TITLES: dict[str, str] = {"none": "no correction", "one_branch": "one branch alone"}
TITLES.update((str(name), title) for name, title in METHOD_TITLES.items())
WANTED_SHARE = 0.95
NORMAL_2_SIGMA = 0.9545
PERCENT = 100.0
NOT_A_NUMBER = "-"


def page(tables: dict[str, FigureData], runs: int, seed: int, sweeps: Sequence[Sweep] = SWEEPS) -> tuple[Section, ...]:
    """Return the study in sections."""
    return (
        section(
            "Study: magnetic deviation determined in flight",
            f"{runs} whole simulated flights and a part of them at every point of the sweeps (the tables say how "
            f"many), seed {seed}; no seed of theirs belongs to a test. Error = corrected minus true magnetic heading, "
            "the truth of the simulation: the INS, the declination and the readings of every flight are wrong by "
            "draws. Brackets hold 95 % limits: of shares exact, of RMS from a bootstrap over flights. The modulus is "
            "fitted with its refusals switched off; how often it is refused stands beside it.",
        ),
        _whole_flights(tables),
        _taxis(tables["magnetic_taxis"]),
        _coverage(tables["magnetic_cells"]),
        _claim(tables),
        *(_sweep(sweep, tables) for sweep in sweeps),
        _incomplete(tables["magnetic_incomplete"]),
    )


# Whole flights


def _whole_flights(tables: dict[str, FigureData]) -> Section:
    verdicts, residuals, honesty = (tables[f"magnetic_{name}"] for name in ("verdicts", "residuals", "honesty"))
    row = int(np.flatnonzero(verdicts["sweep"] == "whole flights")[0])
    flights, kept = int(verdicts["flights"][row]), int(verdicts["accepted"][row])
    text = f"{kept} of {flights} flights were accepted ({_shares(verdicts, row, 'accepted_share', 'low', 'high')})."
    if kept < flights:
        text += f" Most frequent reason of the others: {verdicts['most_frequent_reason'][row]}."
    return section(
        "Is what is left within the stated sigma?",
        "Whole flights from the stand on, drawn from a family of irons, latitudes, latencies and INS errors, answered "
        "as the pipeline does: latencies, alignment on the ground, deviation.",
        text,
        *(residual_claim(honesty, method) for method in JUDGED_METHODS),
        *(coefficient_claim(honesty, method) for method in JUDGED_METHODS),
        _honesty_rows(honesty),
        _left_text(residuals),
        _residual_rows(residuals),
    )


def _taxis(taxis: FigureData) -> Section:
    return section(
        "What aligns the INS",
        "Whole flights after a taxi of every verdict, the INS off by up to 2 deg (third family of "
        "docs/evidence/magnetic.md): A of the table against the truth. Wanted: 0.99 of the tables within 3 sigma, 0.30 "
        "deg rms where accepted.",
        table(taxis),
    )


def _coverage(coverage: FigureData) -> Section:
    return section(
        "Coverage cell by cell",
        "Shares within 1.96 stated sigma on accepted flights, 0.95 wanted: A to E, and the headings of level flight; "
        "D of the iron as error over sigma. First family: whole flights and the points of the sweeps; wide: the cells "
        "of docs/evidence/magnetic.md.",
        table(coverage),
    )


def residual_claim(honesty: FigureData, method: str) -> str:
    """Return in words whether 95 % of the held-out errors stay within 2 stated sigma.

    One error for each flight counts.
    """
    row = int(np.flatnonzero(rows_where(honesty, method=method, error_of=HELD_OUT))[0])
    share, high = float(honesty["inside2"][row]), float(honesty["inside2_high"][row])
    if np.isnan(share):
        return f"{_title(method)}: no flight with a held-out part."
    said = "reached" if share >= WANTED_SHARE else "missed"
    if said == "missed" and high >= WANTED_SHARE:
        said = "missed by less than its sampling error"
    return (
        f"{_title(method)}: held-out error within 2 stated sigma on {_shares(honesty, row, 'inside2')} of "
        f"{int(honesty['flights'][row])} accepted flights, {PERCENT * WANTED_SHARE:.0f} % wanted: {said}."
    )


def coefficient_claim(honesty: FigureData, method: str) -> str:
    """Return in words how many of A to E are within 3 sigma."""
    rows = rows_where(honesty, method=method) & np.isin(honesty["error_of"], LETTERS)
    known = honesty["flights"][rows]
    inside = int(np.sum(np.round(honesty["inside3"][rows] * known)))
    total = int(np.sum(known))
    worst = int(np.argmin(np.where(rows, honesty["inside3"], np.inf)))
    if not total:
        return f"{_title(method)}: no coefficient to judge."
    return (
        f"{_title(method)}: A to E within 3 sigma of the truth in {inside} of {total} cases "
        f"({PERCENT * inside / total:.1f} %), least {honesty['error_of'][worst]} with "
        f"{PERCENT * honesty['inside3'][worst]:.1f} %. {_too_small(honesty, rows)}"
    )


def _too_small(honesty: FigureData, rows: BoolArray) -> str:
    """Return the coefficients within 2 sigma significantly less often than a normal error."""
    shown = rows & (honesty["inside2_high"] < NORMAL_2_SIGMA)
    letters = [
        f"{honesty['error_of'][row]} ({PERCENT * honesty['inside2'][row]:.1f} % within 2 sigma)"
        for row in np.flatnonzero(shown)
    ]
    return (
        f"Shown to be worse than stated: {', '.join(letters)}." if letters else "None is shown to be worse than stated."
    )


def _honesty_rows(honesty: FigureData) -> Grid:
    cells = []
    for row in range(len(honesty)):
        shares = [_shares(honesty, row, f"inside{limit}") for limit in (1, 2, 3)]
        ratio = _number(honesty["rms_ratio"][row], 2)
        method = TITLES[str(honesty["method"][row])]
        cells.append([method, str(honesty["error_of"][row]), str(honesty["flights"][row]), *shares, ratio])
    head = ["method", "error of", "flights", "within 1 sigma", "within 2 sigma", "within 3 sigma", "rms of error/sigma"]
    return grid(head, cells)


def _left_text(residuals: FigureData) -> str:
    before, table, iron = (
        float(residuals["held_out_deg"][rows_where(residuals, method=name)][0]) for name in ("none", TABLE, IRON)
    )
    return (
        f"On the held-out part {_number(before, 2)} deg rms are left without correction, {_number(table, 2)} with the "
        f"table, {_number(iron, 2)} with the iron, against the truth:"
    )


def _residual_rows(residuals: FigureData) -> Grid:
    cells = [
        [
            TITLES[str(residuals["method"][row])],
            str(residuals["fitted"][row]),
            *(_limits(residuals, row, name) for name in ("rms", "shape", "held_out", "held_out_by_ins")),
        ]
        for row in range(len(residuals))
    ]
    head = ["deg rms", "flights", "every heading", "the same without A", "held out, against truth", "held out, by INS"]
    return grid(head, cells)


# The claim


def _claim(tables: dict[str, FigureData]) -> Section:
    claim, power = tables["magnetic_claim"], tables["magnetic_power"]
    horizontal_ut, dip_deg = (float(tables["magnetic_bank"][name][0]) for name in ("horizontal_nt", "dip_deg"))
    horizontal_ut /= 1000.0
    conditions = (
        f"{CLAIM.title}, opposite banks equal: hard iron {SWEPT.hard_iron_sigma_nt:g} nT, soft iron "
        f"{SWEPT.soft_iron_sigma:g} (standard deviations of each element), flown where H is {horizontal_ut:.1f}, Z "
        f"{horizontal_ut * np.tan(np.deg2rad(dip_deg)):.1f} uT; by formula in {PUBLISHED_FIELD_NT[0] / 1000.0:g} and "
        f"{PUBLISHED_FIELD_NT[2] / 1000.0:g} uT, banks held exactly. Deg rms, flown without A, by formula whole."
    )
    head = ["bank", "flights", "published", "average by formula", "average, flown", "one branch, flown", "left over"]
    cells = [
        [
            f"{claim['bank_deg'][row]:g} deg",
            str(claim["fitted"][row]),
            _number(claim["published_deg"][row], 2),
            *(_limits(claim, row, name) for name in ("formula_average", "flown_average", "flown_branch")),
            _shares(claim, row, "left"),
        ]
        for row in range(len(claim))
    ]
    power_cells = [
        [str(power["source"][row]), _limits(power, row, "exponent", 2), _bank(power, row)] for row in range(len(power))
    ]
    return section(
        "Does the bank error cancel between opposite branches?",
        claim_text(claim),
        conditions,
        grid(head, cells),
        limit_text(power),
        grid(["bias of the average", "exponent of bank", f"bank of {LIMITS.bank_bias_max_deg:g} deg"], power_cells),
    )


def claim_text(claim: FigureData) -> str:
    """Return the published claim and the result of the flights, in words."""
    row = int(np.argmin(np.abs(claim["bank_deg"] - BANK_DEG)))
    branch, average = float(claim["flown_branch_deg"][row]), float(claim["flown_average_deg"][row])
    said = "confirmed with a limit" if claim["left_high"][row] < 0.5 else "not confirmed"
    known = np.isfinite(claim["published_deg"])
    ratio = claim["formula_average_deg"][known] / claim["published_deg"][known]
    return (
        f"The claim is {said}: at {claim['bank_deg'][row]:g} deg of bank one branch alone errs by {branch:.2f} deg "
        f"rms, the average of opposite ones by {average:.2f}, {PERCENT * average / branch:.0f} % of it. The bias left "
        f"by formula is {np.min(ratio):.2f} to {np.max(ratio):.2f} times the published one."
    )


def limit_text(power: FigureData) -> str:
    """Return in words how the bias of the average grows and where it passes the limit."""
    row = int(np.flatnonzero(power["source"] == POWER_SOURCES[1])[0])
    low, high = (float(power[f"exponent_{end}"][row]) for end in ("low", "high"))
    square = "as its square within the limits" if low <= 2.0 <= high else (
        "close to its square" if abs(float(power["exponent"][row]) - 2.0) < 0.25 else "not as its square"
    )  # fmt: skip
    return (
        f"What is left grows as bank to the power {_limits(power, row, 'exponent', 2)}, {square}, and passes "
        f"{LIMITS.bank_bias_max_deg:g} deg at {_bank(power, row)} of bank:"
    )


def _bank(power: FigureData, row: int) -> str:
    low, high = (power[f"bank_{end}_deg"][row] for end in ("low", "high"))
    return f"{power['bank_deg'][row]:.1f} deg ({low:.1f} to {high:.1f})"


# Sweeps


def _sweep(sweep: Sweep, tables: dict[str, FigureData]) -> Section:
    errors, verdicts, ratios = (tables[f"magnetic_{name}"] for name in (sweep.name, "verdicts", "ratios"))
    return section(sweep.title, sweep_text(sweep, errors, verdicts, ratios), _sweep_rows(sweep, errors, verdicts))


def sweep_text(sweep: Sweep, table: FigureData, verdicts: FigureData, ratios: FigureData) -> str:
    """Return in words which method is better where, and how much one branch loses.

    The text also says where sigmas and verdicts fail.
    """
    parts = [_comparison(sweep, ratios, IRON, "Without A the iron fit is")]
    branch = rows_where(ratios, sweep=sweep.name, method="one_branch") & np.isfinite(ratios["ratio"])
    if branch.any():
        low, high = np.min(ratios["ratio"][branch]), np.max(ratios["ratio"][branch])
        times = f"{low:.1f}" if f"{low:.1f}" == f"{high:.1f}" else f"{low:.1f} to {high:.1f}"
        parts.append(f"One branch alone errs {times} times as much as the table.")
    for method in (TABLE, IRON):
        known = rows_where(table, method=method) & np.isfinite(table["inside2"])
        if known.any():
            worst = int(np.argmin(np.where(known, table["inside2"], np.inf)))
            value = _value(sweep, float(table[sweep.column][worst]))
            parts.append(
                f"{_title(method)}: at least {PERCENT * table['inside2'][worst]:.0f} % of the headings within 2 stated "
                f"sigma (at {value})."
            )
    own = verdicts["sweep"] == sweep.name
    worst = int(np.argmin(np.where(own, verdicts["accepted_share"], np.inf)))
    parts.append(
        f"Fewest accepted: {_shares(verdicts, worst, 'accepted_share', 'low', 'high')} (at "
        f"{_value(sweep, float(verdicts['value'][worst]))})."
    )
    return " ".join(parts)


def _comparison(sweep: Sweep, ratios: FigureData, method: str, subject: str) -> str:
    said = []
    for verdict, words in (
        (BETTER, "better than the branch table"),
        (WORSE, "worse"),
        (UNDECIDED, "not shown to differ"),
    ):
        chosen = rows_where(ratios, sweep=sweep.name, method=method, finding=verdict)
        if chosen.any():
            said.append(f"{words} at {', '.join(_plain(value) for value in ratios['value'][chosen])}")
    return f"{subject} {'; '.join(said)}." if said else "No flight to compare on."


def _sweep_rows(sweep: Sweep, found: FigureData, verdicts: FigureData) -> Grid:
    cells = []
    for value, _setup in sweep.points:
        row = int(np.flatnonzero(rows_where(verdicts, sweep=sweep.name) & (verdicts["value"] == value))[0])
        flights, refused = int(verdicts["flights"][row]), int(verdicts["modulus_refused"][row])
        counts = f"{verdicts['accepted'][row]} / {verdicts['rejected'][row]} / {verdicts['not_assessable'][row]}"
        for name, words in (("rms", "whole"), ("shape", "without A")):
            rows = [
                int(np.flatnonzero(rows_where(found, method=method) & (found[sweep.column] == value))[0])
                for method in METHODS
            ]
            errors = [_limits(found, place, name) for place in rows]
            if name == "shape":
                errors[-1] += f"; fitted {found['fitted'][rows[-1]]}, to be refused {refused}"
            said = [_value(sweep, value, found, rows[0]), f"{flights}: {counts}"] if name == "rms" else ["", ""]
            cells.append([*said, words, *errors])
    head = [sweep.column.replace("_", " "), "flights: accepted / rejected / not assessable", "error, deg rms"]
    return grid([*head, *(TITLES[method] for method in METHODS)], cells)


def _value(sweep: Sweep, value: float, table: FigureData | None = None, row: int = 0) -> str:
    shown = _plain(value)
    if sweep.name == "dip" and table is not None:
        shown += f" (dip {table['dip_deg'][row]:.0f} deg, H {table['horizontal_nt'][row] / 1000.0:.1f} uT)"
    return shown


# Refusals


def _incomplete(refusals: FigureData) -> Section:
    cells = [
        [
            *(str(refusals[name][row]) for name in ("figure", "flights", "verdict", "count")),
            _shares(refusals, row, "share", "low", "high"),
            str(refusals["reason"][row]),
        ]
        for row in range(len(refusals))
    ]
    return section(
        "Are incomplete figures refused, and why?",
        refusal_text(refusals),
        grid(["figure", "flights", "verdict", "count", "share", "reason (# is a number)"], cells),
    )


def refusal_text(table: FigureData) -> str:
    """Return in words how many of the incomplete figures were not accepted."""
    total = sum(int(table["flights"][table["figure"] == kind][0]) for kind in np.unique(table["figure"]))
    let_through = table["verdict"] == "accept"
    passed = int(np.sum(table["count"][let_through]))
    if not passed:
        return f"All {total} flights with an incomplete figure were refused or rejected, each with its reason."
    kinds = ", ".join(sorted({str(kind) for kind in table["figure"][let_through]}))
    return (
        f"{total - passed} of {total} flights with an incomplete figure were refused or rejected; accepted were "
        f"{passed}: {kinds}."
    )


# Cells


def _title(method: str) -> str:
    return TITLES[method].capitalize()


def _plain(value: float) -> str:
    return f"{value:.3g}" if abs(value) < 100.0 else f"{value:g}"


def _number(value: float, digits: int) -> str:
    return NOT_A_NUMBER if np.isnan(value) else f"{value:.{digits}f}"


def _limits(table: FigureData, row: int, stem: str, digits: int = 2) -> str:
    """Return a value with its limits; the unit stands last in the columns' names."""
    unit = "_deg" if f"{stem}_deg" in table.columns else ""
    value, low, high = (float(table[f"{stem}{end}{unit}"][row]) for end in ("", "_low", "_high"))
    return NOT_A_NUMBER if np.isnan(value) else f"{value:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def _shares(table: FigureData, row: int, name: str, low: str = "", high: str = "") -> str:
    """Return a share with its limits, in per cent."""
    value = float(table[name][row])
    if np.isnan(value):
        return NOT_A_NUMBER
    ends = (float(table[column][row]) for column in (low or f"{name}_low", high or f"{name}_high"))
    return "{:.1f} % ({:.1f} to {:.1f})".format(*(PERCENT * part for part in (value, *ends)))
