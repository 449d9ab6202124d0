"""Parts of the chapter on magnetic deviation: the installed heading sensor on straight ground runs."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from groundstation.chapters.parts import Cell, Facts, Grid, Head, Mark, Note, Part
from groundstation.chapters.wording import ABSENT, clock, is_number, number, typeset
from groundstation.reports import drawing as d
from groundstation.reports.drawing import Drawing
from groundstation.reports.sections.heading import setting_facts
from groundstation.reports.sections.saved import mapping, objects
from groundstation.results.figures import flags, numbers
from groundstation.results.files import SavedFlight
from groundstation.results.magnetic import ADVISORY

BAND = 1.96  # half width of a 95 % band in sigmas
MOST_RUNS = 40
LEAST_SPAN_DEG = 2.0  # of the error axis
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


def parts(saved: SavedFlight) -> tuple[Part, ...]:
    """What the ground runs tell; nothing where there are none."""
    ground = mapping(saved.summary, "results", "magnetic_ground")
    used = [run for run in objects(ground, "runs") if run.get("state") == "used" and is_number(run.get("error_deg"))]
    if not used:
        return ()
    found: tuple[Part | None, ...] = (
        Note(f"{LEAD} {_conclusion(ground, used)} {ADVISORY}"),
        _drawing(saved, used),
        _runs(objects(ground, "runs")),
        _coefficients(ground),
        _repeats(ground),
        _basis(ground),
        *(Note(_sentence(remark)) for remark in ground.get("remarks") or ()),
        Note(HOW),
        _settings(ground),
    )
    return tuple(part for part in found if part is not None)


def _settings(ground: Mapping[str, Any]) -> Facts | None:
    facts = setting_facts(ground)
    return replace(facts, title="Ground runs: settings") if facts else None


def _sentence(text: Any) -> str:
    told = typeset(str(text)).strip().rstrip(".")
    return f"{told[:1].upper()}{told[1:]}."


def _with_sigma(value: Any, sigma: Any, places: int = 2) -> str:
    return f"{number(value, places, signed=True)} ± {number(sigma, places)}" if is_number(value) else ABSENT


def _conclusion(ground: Mapping[str, Any], used: Sequence[Mapping[str, Any]]) -> str:
    errors = [float(run["error_deg"]) for run in used]
    spanned = " to ".join(number(value, 1, "°", signed=True) for value in sorted({min(errors), max(errors)}))
    runs = "one run" if len(used) == 1 else f"{len(used)} runs"
    count = ground.get("directions")
    directions = "one direction" if count == 1 else f"{number(count, 0)} directions"
    return f"Here {runs} in {directions}: error {spanned}."


def _drawing(saved: SavedFlight, used: Sequence[Mapping[str, Any]]) -> Drawing:
    """Error by magnetic heading: every run with its bar, its epochs behind it, the curve where there is one."""
    heading, error, sigma = (
        np.array([run[name] if is_number(run.get(name)) else np.nan for run in used], dtype=np.float64)
        for name in ("magnetic_heading_deg", "error_deg", "sigma_deg")
    )
    half = BAND * sigma
    curve, epochs = saved.figure("magnetic_ground_curve"), saved.figure("magnetic_ground_epochs")
    low, high = float(np.nanmin(error - half)), float(np.nanmax(error + half))
    middle, reach = 0.5 * (low + high), max(0.6 * (high - low), 0.5 * LEAST_SPAN_DEG)

    def paint(figure: Any) -> None:
        axes = d.place(figure, 16, 12, 174, 66)
        if epochs is not None:
            mine = flags(epochs, "is_used")
            x, y = numbers(epochs, "magnetic_heading_deg")[mine], numbers(epochs, "error_deg")[mine]
            d.dots(axes, x, y, d.UNUSED, 2.4, 2500, label="epochs")
        if curve is not None and np.isfinite(numbers(curve, "error_deg")).any():
            x, y = numbers(curve, "magnetic_heading_deg"), numbers(curve, "error_deg")
            band = BAND * numbers(curve, "sigma_deg")
            axes.fill_between(x, y - band, y + band, color=d.USED, alpha=0.15, linewidth=0)
            d.line(axes, x, y, d.USED, 1.2, label="A to E")
        axes.errorbar(
            heading,
            error,
            half,
            fmt="o",
            color=d.INS,
            markersize=3.5,
            elinewidth=1.1,
            capsize=2.5,
            zorder=4,
            label="runs",
        )
        axes.axhline(0.0, color=d.FAINT, linewidth=0.6)
        axes.set_ylim(middle - reach, middle + reach)
        axes.set_xlim(0.0, 360.0)
        axes.set_xticks(range(0, 361, 30))
        axes.set_xlabel("magnetic heading as read, °")
        axes.set_ylabel("error of the heading, °")
        d.legend_above(axes, 3)

    caption = (
        f"Magnetic heading + declination − track, n = {len(used)} runs with ± 1.96 σ (noise, slip and declination, the "
        "last common to all). Line and shade: the curve with its 95 % band, drawn only where it is known well enough. "
        "Epochs beyond the axis are cut."
    )
    alt = "Error of the installed heading sensor against magnetic heading, one bar for each straight ground run."
    names = ("magnetic_ground_epochs", "magnetic_ground_curve")
    return Drawing("Ground runs: error by heading", caption, alt, d.draw("magnetic-ground", 74, paint), names)


def _runs(runs: Sequence[Mapping[str, Any]]) -> Grid:
    rows: list[tuple[Cell, ...]] = []
    for run in runs[:MOST_RUNS]:
        is_used = run.get("state") == "used"
        rows.append(
            (
                Mark("good", "used") if is_used else Mark("unknown", "not used"),
                f"{clock(run.get('start_s'))} – {clock(run.get('end_s'))}",
                str(run.get("phase") or ""),
                number(run.get("samples"), 0),
                number(run.get("speed_mps"), 1),
                number(run.get("magnetic_heading_deg"), 1),
                number(run.get("track_deg"), 1),
                _with_sigma(run.get("error_deg"), run.get("sigma_deg")),
                number(run.get("noise_sigma_deg"), 2),
                typeset(str(run.get("reason") or "")),
            )
        )
    titles = ("Epochs", "V, m/s", "Reading, °", "Track, °", "Error, °", "Noise, °")
    heads = (
        *(Head(title) for title in ("State", "Flight time", "Phase")),
        *(Head(title, True) for title in titles),
        Head("Reason"),
    )
    left = f" {len(runs) - MOST_RUNS} later runs are left out." if len(runs) > MOST_RUNS else ""
    caption = f"Mean reading and true track. Noise is σ of the run alone; ± holds slip and declination too.{left}"
    return Grid("Ground runs", heads, rows, caption, ("magnetic_ground_epochs",))


def _coefficients(ground: Mapping[str, Any]) -> Grid:
    rows: list[tuple[Cell, ...]] = []
    for row in objects(ground, "coefficients"):
        is_found = is_number(row.get("value_deg"))
        told = _with_sigma(row.get("value_deg"), row.get("sigma_deg")) if is_found else "not observable"
        open_to = "" if is_found else f"{_sentence(row.get('reason'))} ± {number(row.get('sigma_deg'), 1, '°')} open."
        rows.append((str(row.get("letter")), told, open_to))
    along = mapping(ground, "along")
    if along:
        axis = along.get("axis_deg")
        told = _with_sigma(along.get("value_deg"), along.get("sigma_deg"))
        rows.append((f"B and C on {number(axis, 0, '°')}", told, "Times the cosine of heading less that axis."))
    caption = (
        "error(c) = A + B sin c + C cos c + D sin 2c + E cos 2c, c the uncorrected magnetic heading, ± standard "
        "deviation, that of the declination in A. The deviation to add has the opposite signs."
    )
    heads = (Head(""), Head("Value, °", True), Head("What is not seen"))
    return Grid("Ground runs: coefficients", heads, rows, caption)


def _repeats(ground: Mapping[str, Any]) -> Grid | None:
    rows = [
        (
            number(row.get("magnetic_heading_deg"), 0, "°"),
            number(row.get("runs"), 0),
            number(row.get("spread_deg"), 2),
            number(row.get("expected_deg"), 2),
        )
        for row in objects(ground, "repeats")
    ]
    if not rows:
        return None
    titles = ("Near", "Runs", "Spread, °", "Expected, °")
    caption = "Standard deviation of the errors of runs on about one heading, and what their noise and slip would make."
    return Grid("Ground runs: repeated headings", tuple(Head(title, True) for title in titles), rows, caption)


def _basis(ground: Mapping[str, Any]) -> Facts:
    declination = mapping(ground, "declination")
    left_out = "; ".join(f"{row.get('reason')} {number(row.get('epochs'), 0)}" for row in objects(ground, "left_out"))
    pairs = (
        ("Sensors", f"{ground.get('ins_topic')} against {ground.get('gnss_topic')}", ""),
        (
            "Declination",
            f"{_with_sigma(declination.get('value_deg'), declination.get('sigma_deg'))}°",
            typeset(str(declination.get("model") or "")),
        ),
        ("Widest gap between headings", number(ground.get("widest_gap_deg"), 0, "°"), ""),
        (
            "What a run has of its own",
            number(ground.get("place_sigma_deg"), 2, "°"),
            "standard deviation beyond noise and slip, with what was taken for likely beforehand",
        ),
        ("Epochs in no run", left_out or ABSENT, ""),
    )
    return Facts("Ground runs: what they rest on", pairs)
