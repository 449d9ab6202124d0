"""Parts of the chapter on magnetic deviation: the installed heading sensor on straight ground runs."""

from collections.abc import Sequence
from dataclasses import replace

from groundstation.chapters.gates import setting_facts
from groundstation.chapters.parts import Cell, Facts, Figure, Grid, Head, Mark, Note, Part
from groundstation.chapters.wording import ABSENT, clock, is_number, number, sentence, typeset
from groundstation.results.flight import FlightResults
from groundstation.results.magnetic import ADVISORY
from groundstation.results.magnetic_ground import GroundCoefficient, GroundDeviation, GroundRun

MOST_RUNS = 40
LEAD = (
    "Installed heading sensor on straight ground runs: on its wheels an aircraft has no drift angle, so the GNSS track "
    "is the true heading of the nose, and magnetic heading + declination − track is the error of the sensor."
)
HOW = (
    "How computed: runs of steady heading with ground contact proven; one noise model for all, correlated over "
    "seconds, and an error of its own for each run. A to E with what a run has of its own (iron in the ground, loads) "
    "integrated out; what the directions do not show is not given and counts in σ of the rest. A = level, B and C = "
    "semicircular, D and E = quadrantal."
)


def ground_runs(results: FlightResults) -> tuple[Part, ...]:
    """What the ground runs tell; nothing where there are none."""
    answer = results.answer(GroundDeviation)
    errors_deg = [run.error_deg for run in answer.used if run.error_deg is not None] if answer else []
    if answer is None or not errors_deg:
        return ()
    found: tuple[Part | None, ...] = (
        Note(f"{LEAD} {_conclusion(answer, errors_deg)} {ADVISORY}"),
        Figure("magnetic.ground_runs"),
        _runs(answer.runs),
        _coefficients(answer),
        _repeats(answer),
        _basis(answer),
        *(Note(sentence(remark)) for remark in answer.remarks),
        Note(HOW),
        _settings(answer),
    )
    return tuple(part for part in found if part is not None)


def _settings(answer: GroundDeviation) -> Facts | None:
    facts = setting_facts(answer.settings)
    return replace(facts, title="Ground runs: settings") if facts else None


def _with_sigma(value: float | None, sigma: float | None, places: int = 2) -> str:
    return f"{number(value, places, signed=True)} ± {number(sigma, places)}" if is_number(value) else ABSENT


def _conclusion(answer: GroundDeviation, errors_deg: Sequence[float]) -> str:
    ends = sorted({min(errors_deg), max(errors_deg)})
    spanned = " to ".join(number(value, 1, "°", signed=True) for value in ends)
    runs = "one run" if len(errors_deg) == 1 else f"{len(errors_deg)} runs"
    directions = "one direction" if answer.directions == 1 else f"{number(answer.directions, 0)} directions"
    return f"Here {runs} in {directions}: error {spanned}."


def _runs(runs: Sequence[GroundRun]) -> Grid:
    titles = ("Epochs", "V, m/s", "Reading, °", "Track, °", "Error, °", "Noise, °")
    heads = (
        *(Head(title) for title in ("State", "Flight time", "Phase")),
        *(Head(title, True) for title in titles),
        Head("Reason"),
    )
    left = f" {len(runs) - MOST_RUNS} later runs are left out." if len(runs) > MOST_RUNS else ""
    caption = f"Mean reading and true track. Noise is σ of the run alone; ± holds slip and declination too.{left}"
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
        rows.append((f"B and C on {number(axis, 0, '°')}", told, "Times the cosine of heading less that axis."))
    caption = (
        "error(c) = A + B sin c + C cos c + D sin 2c + E cos 2c, c the uncorrected magnetic heading, ± standard "
        "deviation, that of the declination in A. The deviation to add has the opposite signs."
    )
    heads = (Head(""), Head("Value, °", True), Head("What is not seen"))
    return Grid("Ground runs: coefficients", heads, rows, caption)


def _coefficient(row: GroundCoefficient) -> tuple[Cell, ...]:
    if is_number(row.value_deg):
        return row.letter, _with_sigma(row.value_deg, row.sigma_deg), ""
    return row.letter, "not observable", f"{sentence(row.reason)} ± {number(row.sigma_deg, 1, '°')} open."


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
    caption = "Standard deviation of the errors of runs on about one heading, and what their noise and slip would make."
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
            "What a run has of its own",
            number(answer.place_sigma_deg, 2, "°"),
            "standard deviation beyond noise and slip, with what was taken for likely beforehand",
        ),
        ("Epochs in no run", left_out or ABSENT, ""),
    )
    return Facts("Ground runs: what they rest on", pairs)
