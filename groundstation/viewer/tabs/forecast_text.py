"""The text panel of the forecast tab: how far to trust it, then skill by method and horizon."""

from collections.abc import Sequence

from groundstation.results.forecast import METHODS, ForecastResult, SkillRow, honesty
from groundstation.viewer.markdown import markdown_text, number, table
from groundstation.viewer.names import words


def forecast_text(result: ForecastResult | None, reasons: Sequence[str] = (), *, kind: str = "unaided") -> str:
    """Markdown of the panel; without a result the reasons why there is none. ``kind`` is that of the INS."""
    if result is None:
        return "\n\n".join(["# Forecast not assessed", *(markdown_text(reason) for reason in reasons)])
    parts = [
        "# This INS is aided by GNSS: a forecast from it means nothing" if kind == "gnss_aided" else _headline(result),
        "Whether GNSS corrects this INS already **cannot be told**." if kind == "unknown" else "",
        _calibrated(result),
        *_skill(result),
        *_calibration(result),
        *_gaps(result),
        *_phases(result),
        *_coupled(result),
    ]
    return "\n\n".join(part for part in parts if part)


def _headline(result: ForecastResult) -> str:
    return f"# Shipped method: {markdown_text(METHODS.get(result.default_method, result.default_method))}"


def _calibrated(result: ForecastResult) -> str:
    if not result.is_calibrated:
        return f"**Not calibrated**: {markdown_text(result.calibration_reason)}"
    return "Calibrated on what lies before each start: the log holds a Schuler period before the first one."


def _skill(result: ForecastResult) -> list[str]:
    horizons = sorted({row.horizon_min for row in result.skill})
    if not horizons:
        return []
    rows = {(row.method, row.horizon_min): row for row in result.skill}
    methods = [name for name in METHODS if any(method == name for method, _ in rows)]
    lines = []
    for name in methods:
        title = words(name) + (" (shipped)" if name == result.default_method else "")
        cells = [
            _rms(rows.get((name, horizon)), result.best_method.get(f"{horizon:g}") == name) for horizon in horizons
        ]
        lines.append([title, *cells])
    default = [rows.get((result.default_method, horizon)) for horizon in horizons]
    lines.append(["in 95 % band", *(_share(row.coverage95 if row else None) for row in default)])
    lines.append(["starts", *(str(row.starts) if row else "–" for row in default)])
    head = ["RMS, m, at min", *(f"{horizon:g}" for horizon in horizons)]
    return ["## Radial error built up since the start; the best of this flight is bold", table(head, lines)]


def _rms(row: SkillRow | None, is_best: bool) -> str:
    text = "–" if row is None else number(row.rms_m, 0)
    return f"**{text}**" if is_best and text != "–" else text


def _share(value: float | None) -> str:
    return "–" if value is None else number(100.0 * value, 0, "%")


def _calibration(result: ForecastResult) -> list[str]:
    rows = [
        [
            number(row.horizon_min, 0),
            *(_share(share) for share in (row.inside50, row.inside68, row.inside95)),
            f"{number(row.nees, 2)} ({number(row.nees_low, 2)} … {number(row.nees_high, 2)})",
            number(row.scale, 2),
            honesty(row.independent_starts, row.nees, row.nees_low, row.nees_high),
        ]
        for row in result.calibration
        if row.method == result.default_method
    ]
    head = ["min", "in 50 %", "in 68 %", "in 95 %", "NEES (limits)", "σ scale", "NEES is"]
    return ["## Is the claimed sigma honest, shipped method", table(head, rows)] if rows else []


def _gaps(result: ForecastResult) -> list[str]:
    rows = [
        [row.method, number(row.length_min, 0), str(row.starts), number(row.max_error_rms_m, 0), _share(row.coverage95)]
        for row in result.gaps
    ]
    head = ["method", "gap, min", "gaps", "largest error, RMS, m", "in 95 %"]
    return ["## Gaps with GNSS on both sides", table(head, rows)] if rows else []


def _phases(result: ForecastResult) -> list[str]:
    rows = [
        [
            markdown_text(row.phase),
            number(row.length_s, 0),
            str(row.starts),
            number(row.rms_m, 1),
            number(row.raw_rms_m, 1),
        ]
        for row in result.phases
    ]
    head = ["phase at the start", "length, s", "starts", "RMS, m", "raw INS, m"]
    title = "## Outages by flight phase; other starts than above (every 60 s from 10 min on), so other numbers"
    return [title, table(head, rows)] if rows else []


def _coupled(result: ForecastResult) -> list[str]:
    rows = [
        [number(row.horizon_min, 0), number(row.rms_m, 0), number(100.0 * row.gain, 0, "%", sign=True)]
        for row in result.coupled
    ]
    head = ["min", "RMS, m", "gain"]
    return ["## Coupled model (fourteen states) against two channels", table(head, rows)] if rows else []
