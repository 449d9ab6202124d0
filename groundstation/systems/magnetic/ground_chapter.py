"""Parts of the chapter on magnetic deviation: straight ground runs.

The ground runs judge the heading sensor as installed.
"""

from collections.abc import Sequence

from groundstation.chapters.gates import setting_facts
from groundstation.chapters.parts import Cell, Claim, Facts, Figure, Grid, Head, Mark, Note, Part, Rank, kept
from groundstation.chapters.wording import ABSENT, clock, is_number, number, sentence, typeset
from groundstation.results.flight import FlightResults
from groundstation.systems.magnetic.answer import ADVISORY
from groundstation.systems.magnetic.ground_answer import GroundCoefficient, GroundDeviation, GroundRun

MOST_RUNS = 40
TITLE = "Heading sensor on ground runs"
LEAD = "On straight ground runs the nose points along the GNSS track: reading + declination − track is the error."
HOW = (
    "How computed: runs of steady heading, ground contact proven; one noise model for all, correlated over seconds. A "
    "to E (A level, B and C semicircular, D and E quadrantal) with a separate error of each run (iron in the ground, "
    "loads) integrated out; coefficients that the directions do not show add to σ of the others."
)


def ground_runs(results: FlightResults) -> tuple[Part, ...]:
    """Return what the ground runs show; empty without runs."""
    answer = results.answer(GroundDeviation)
    errors_deg = [run.error_deg for run in answer.used if run.error_deg is not None] if answer else []
    if answer is None or not errors_deg:
        return ()
    return kept(
        (
            Note(f"Heading sensor: {_conclusion(answer, errors_deg)} {ADVISORY}"),
            Figure("magnetic.ground_runs"),
            _runs(answer.runs),
            *(Note(sentence(remark)) for remark in answer.remarks),
        )
    )


def ground_workings(results: FlightResults) -> tuple[Part, ...]:
    """Return the parts for the appendix of a report; empty without runs."""
    answer = results.answer(GroundDeviation)
    if answer is None or not ground_runs(results):
        return ()
    settings = setting_facts(answer.settings, "magnetic_ground")
    return kept((_coefficients(answer), _repeats(answer), _basis(answer), Note(HOW), settings))


def ground_claim(results: FlightResults) -> Claim | None:
    """Return the claim of the ground runs; None without runs."""
    answer = results.answer(GroundDeviation)
    errors_deg = [run.error_deg for run in answer.used if run.error_deg is not None] if answer else []
    if answer is None or not errors_deg:
        return None
    span = _span(errors_deg)
    return Claim(
        Rank.GROUND_RUNS,
        Mark("good", "Measured"),
        f"Heading sensor off by {span} on the ground",
        value=span,
        remark=_on_runs(answer, errors_deg),
        sentences=(f"{_on_runs(answer, errors_deg).capitalize()}. {ADVISORY}",),
        figures=(("Error of the heading sensor", span, _on_runs(answer, errors_deg)),),
    )


def _with_sigma(value: float | None, sigma: float | None, places: int = 2) -> str:
    return f"{number(value, places, signed=True)} ± {number(sigma, places)}" if is_number(value) else ABSENT


def _span(errors_deg: Sequence[float]) -> str:
    ends = dict.fromkeys(number(value, 1, "°", signed=True) for value in (min(errors_deg), max(errors_deg)))
    return " to ".join(ends)


def _on_runs(answer: GroundDeviation, errors_deg: Sequence[float]) -> str:
    runs = "one straight run" if len(errors_deg) == 1 else f"{len(errors_deg)} straight runs"
    directions = "one direction" if answer.directions == 1 else f"{number(answer.directions, 0)} directions"
    return f"{runs} in {directions}"


def _conclusion(answer: GroundDeviation, errors_deg: Sequence[float]) -> str:
    return f"{_on_runs(answer, errors_deg)}, error {_span(errors_deg)}."


def _runs(runs: Sequence[GroundRun]) -> Grid:
    titles = ("Epochs", "V, m/s", "Reading, °", "Track, °", "Error, °", "Noise, °")
    heads = (
        *(Head(title) for title in ("State", "Flight time", "Phase")),
        *(Head(title, True) for title in titles),
        Head("Reason"),
    )
    left = f" {len(runs) - MOST_RUNS} later runs are left out." if len(runs) > MOST_RUNS else ""
    caption = f"Mean reading and true track. Noise is σ of the run alone; ± includes slip and declination.{left}"
    rows = [_run(run) for run in runs[:MOST_RUNS]]
    return Grid("Ground runs", heads, rows, caption, ("magnetic_ground_epochs",))


def _run(run: GroundRun) -> tuple[Cell, ...]:
    return (
        Mark("good", "used") if run.state == "used" else Mark("unknown", "not used"),
        f"{clock(run.start_s)} – {clock(run.end_s)}",
        run.phase,
        number(run.samples, 0),
        number(run.speed_mps, 1),
        number(run.magnetic_heading_deg, 1),
        number(run.track_deg, 1),
        _with_sigma(run.error_deg, run.sigma_deg),
        number(run.noise_sigma_deg, 2),
        typeset(run.reason),
    )


def _coefficients(answer: GroundDeviation) -> Grid:
    rows: list[tuple[Cell, ...]] = [_coefficient(row) for row in answer.coefficients]
    if answer.along:
        axis, told = answer.along.axis_deg, _with_sigma(answer.along.value_deg, answer.along.sigma_deg)
        rows.append((f"B and C on {number(axis, 0, '°')}", told, "Multiply by the cosine of heading minus that axis."))
    caption = (
        "error(c) = A + B sin c + C cos c + D sin 2c + E cos 2c, c the uncorrected magnetic heading, ± standard "
        "deviation, that of the declination in A. The deviation to add has the opposite signs."
    )
    heads = (Head(""), Head("Value, °", True), Head("What is not observable"))
    return Grid("Ground runs: coefficients", heads, rows, caption)


def _coefficient(row: GroundCoefficient) -> tuple[Cell, ...]:
    if is_number(row.value_deg):
        return row.letter, _with_sigma(row.value_deg, row.sigma_deg), ""
    return row.letter, "not observable", f"{sentence(row.reason)} Unknown within ± {number(row.sigma_deg, 1, '°')}."


def _repeats(answer: GroundDeviation) -> Grid | None:
    rows = [
        (
            number(row.magnetic_heading_deg, 0, "°"),
            number(row.runs, 0),
            number(row.spread_deg, 2),
            number(row.expected_deg, 2),
        )
        for row in answer.repeats
    ]
    if not rows:
        return None
    titles = ("Near", "Runs", "Spread, °", "Expected, °")
    caption = (
        "Standard deviation of the errors of runs on about one heading, and the value expected from their noise and "
        "slip."
    )
    return Grid("Ground runs: repeated headings", tuple(Head(title, True) for title in titles), rows, caption)


def _basis(answer: GroundDeviation) -> Facts:
    declination = answer.declination
    left_out = "; ".join(f"{row.reason} {number(row.epochs, 0)}" for row in answer.left_out)
    pairs = (
        ("Sensors", f"{answer.ins_topic} against {answer.gnss_topic}", ""),
        (
            "Declination",
            f"{_with_sigma(declination.value_deg, declination.sigma_deg)}°",
            typeset(declination.model),
        ),
        ("Widest gap between headings", number(answer.widest_gap_deg, 0, "°"), ""),
        (
            "Own error of a run",
            number(answer.place_sigma_deg, 2, "°"),
            "standard deviation beyond noise and slip, prior included",
        ),
        ("Epochs in no run", left_out or ABSENT, ""),
    )
    return Facts("Ground runs: basis", pairs)
