"""Chapter on the forecast (system 2).

How good it is by method and horizon, and whether its sigma is honest.
"""

from collections.abc import Iterable

from groundstation.base.words import capitalised
from groundstation.chapters.assessed import without_answer
from groundstation.chapters.parts import Cell, Figure, Grid, Head, Mark, Part, Section, Tone, kept
from groundstation.chapters.wording import clock, is_number, number, percent, words
from groundstation.results.flight import FlightResults
from groundstation.results.forecast_methods import FORECAST_METHODS
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.claim_chapter import forecast_claim, lead_of
from groundstation.systems.inertial.conclusions_chapter import conclusions, rows_of, title_of
from groundstation.systems.inertial.forecast_answer import (
    FEWEST_STARTS,
    CalibrationRow,
    CoupledRow,
    ForecastResult,
    GapRow,
    SkillRow,
    honesty,
)

HONESTY_TONES: dict[str, Tone] = {"within limits": "good", "too sure": "warn"}
COMPARED = ("last_estimate", "windows")  # beside the shipped method in the calibration table
TITLE = "Forecast without GNSS"
LEAD = (
    "GNSS is withheld at many moments of this flight: the radial error that grows after each, against the recorded "
    "GNSS."
)


def forecast(results: FlightResults) -> Section | None:
    """Return the chapter; None when the flight was not assessed and no reason is known."""
    answer, ins = results.answer(ForecastResult), results.answer(InertialResult)
    if answer is None:
        return without_answer(results, "forecast", TITLE, LEAD)
    notes = conclusions(answer)
    parts: tuple[Part | None, ...] = (
        *notes,
        Figure("forecast.growth"),
        _skill(answer),
        Figure("forecast.calibration"),
        Figure("forecast.hindcast_map"),
        _gaps(answer.gaps),
    )
    workings: tuple[Part | None, ...] = (
        *(_default_in_detail(answer), *_calibration(answer), _phases(answer), _coupled(answer.coupled)),
    )
    headline = f"Shipped method: {title_of(answer.default_method)}"
    tone: Tone = "warn" if any(note.tone == "warn" for note in notes) else "good"
    told = None
    if ins is not None and ins.kind == "unaided":
        told = forecast_claim(answer, tuple(note.text for note in notes[:2]), tone)
    lead = LEAD if ins is None else lead_of(LEAD, ins.ins_topic, results)
    return Section("forecast", TITLE, lead, kept(parts), headline, claim=told, appendix=kept(workings))


def short(method: str) -> str:
    """Return the name of a method for the head of a column.

    Examples
    --------
    >>> short("raw_ins"), short("last_estimate")
    ('raw INS', 'last estimate')
    """
    return " ".join("INS" if word == "ins" else word for word in words(method).split())


def _heads(first: str, titles: Iterable[str]) -> tuple[Head, ...]:
    """Return a head for the names and one for each column of numbers."""
    return (Head(first), *(Head(title, True) for title in titles))


def _skill(answer: ForecastResult) -> Grid | None:
    horizons = sorted({float(row.horizon_min) for row in answer.skill if is_number(row.horizon_min)})
    methods = [name for name in FORECAST_METHODS if rows_of(answer, name)]
    if not horizons or not methods:
        return None
    default = answer.default_method
    rows: list[list[Cell]] = []
    for name in methods:
        mine = rows_of(answer, name)
        title = title_of(name) + (" (shipped)" if name == default else "")
        rows.append([title, *(_rms(mine.get(lead), answer.best_method.get(f"{lead:g}") == name) for lead in horizons)])
    shipped = [rows_of(answer, default).get(lead) for lead in horizons]
    rows.append(["Starts", *(number(None if row is None else row.starts, 0) for row in shipped)])
    heads = _heads("RMS radial error, m", (f"{lead:g} min" for lead in horizons))
    step = number(answer.start_step_s, 0, "s")
    caption = (
        f"Starts every {step} from flight time {clock(answer.first_start_s)}, while the horizon fits into the flight; "
        "✓ smallest on this flight. Neighbouring starts share most of their data."
    )
    return Grid("Skill by method and horizon", heads, rows, caption, ("forecast_growth",))


def _rms(row: SkillRow | None, is_best: bool) -> Cell:
    text = number(None if row is None else row.rms_m, 0)
    return Mark("good", text) if is_best else text


def _default_in_detail(answer: ForecastResult) -> Grid | None:
    rows = [
        (
            f"{lead:g} min",
            number(row.starts, 0),
            number(row.rms_m, 0),
            number(row.median_m, 0),
            number(row.p95_m, 0),
            percent(row.coverage95),
            percent(row.coverage95_model),
        )
        for lead, row in sorted(rows_of(answer, answer.default_method).items())
    ]
    heads = _heads("Horizon", ("Starts", "RMS, m", "Median, m", "95 %, m", "In 95 % band", "Before scaling"))
    caption = "Short term: up to 10 min; long term: beyond. Before scaling: with the unscaled σ of the model."
    return Grid("The shipped method in detail", heads, rows, caption) if rows else None


def _calibration(answer: ForecastResult) -> list[Grid]:
    """Return a table for each method compared: the shipped one first."""
    titles = ("Starts", "Independent", "In 50 %", "In 68 %", "In 95 %", "NEES", "95 % limits", "σ scale")
    heads = (*_heads("Horizon", titles), Head("NEES is"))
    caption = (
        "NEES: mean squared error over the variance claimed, 1 is honest; its 95 % limits come from the number of "
        f"independent starts; fewer than {FEWEST_STARTS} are not judged. σ scale: factor on the model's σ."
    )
    grids: list[Grid] = []
    for name in dict.fromkeys((answer.default_method, *COMPARED)):
        rows = [_calibration_cells(row) for row in answer.calibration if row.method == name]
        if rows:
            title = f"Is the claimed σ honest? {capitalised(short(name))}"
            grids.append(Grid(title, heads, rows, "" if grids else caption))
    return grids


def _calibration_cells(row: CalibrationRow) -> tuple[Cell, ...]:
    state: Cell = ""
    if all(map(is_number, (row.nees, row.nees_low, row.nees_high))):
        text = honesty(row.independent_starts, row.nees, row.nees_low, row.nees_high)
        state = Mark(HONESTY_TONES.get(text, "unknown"), text)
    return (
        number(row.horizon_min, 0, "min"),
        number(row.starts, 0),
        number(row.independent_starts, 0),
        *(percent(share) for share in (row.inside50, row.inside68, row.inside95)),
        number(row.nees, 2),
        f"{number(row.nees_low, 2)} … {number(row.nees_high, 2)}",
        number(row.scale, 2),
        state,
    )


def _gaps(gaps: tuple[GapRow, ...]) -> Grid | None:
    found = {(row.length_min, row.method): row for row in gaps}
    rows = []
    for length in sorted({row.length_min for row in gaps}):
        both = found.get((length, "forward")), found.get((length, "rts"))
        starts = next((row.starts for row in both if row is not None), None)
        sizes = (number(None if row is None else row.max_error_rms_m, 0) for row in both)
        shares = (percent(None if row is None else row.coverage95) for row in both)
        rows.append((f"{length:g} min", number(starts, 0), *sizes, *shares))
    heads = _heads("Length", ("Gaps", "Forward, m", "RTS, m", "Forward in 95 %", "RTS in 95 %"))
    caption = (
        "Largest radial error in each gap, RMS over the gaps. Forward: forecast, for use on board; RTS: smoothed with "
        "the data after the gap, for the reference trajectory."
    )
    return Grid("Gaps with GNSS on both sides", heads, rows, caption) if rows else None


def _phases(answer: ForecastResult) -> Grid | None:
    first = clock(answer.first_start_s)
    rows = [
        (
            row.phase if row.is_early is None else f"{row.phase}, {'before' if row.is_early else 'from'} {first}",
            clock(row.length_s),
            number(row.starts, 0),
            number(row.rms_m, 1),
            number(row.raw_rms_m, 1),
        )
        for row in answer.phases
    ]
    heads = _heads("Begins in", ("Length", "Starts", "Shipped, RMS m", "Raw INS, RMS m"))
    caption = (
        f"Lengths in min:s. From {first} of flight time on: the starts of the skill table, hence the same numbers. "
        "Before it: every 60 s from 10 min after the first epoch, when the filter has hardly settled."
    )
    return Grid("Outages by phase of flight", heads, rows, caption) if rows else None


def _coupled(coupled: tuple[CoupledRow, ...]) -> Grid | None:
    rows = [
        (
            number(row.horizon_min, 0, "min"),
            number(row.rms_m, 0),
            number(100.0 * row.gain, 0, "%", signed=True),
        )
        for row in coupled
    ]
    heads = _heads("Horizon", ("Coupled, RMS m", "Gain"))
    caption = (
        "Sixteen states (six of each channel, coupled, azimuth and its drift, accelerometer biases) compared with two "
        "separate channels; both with the last estimate."
    )
    return Grid("Coupled model", heads, rows, caption) if rows else None
