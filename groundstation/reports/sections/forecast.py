"""Chapter: the forecast (system 2): how good it is by method and horizon, and whether its sigma is honest."""

from collections.abc import Mapping, Sequence
from typing import Any

from groundstation.chapters.parts import Cell, Grid, Head, Mark, Note, Part, Section, Tone
from groundstation.chapters.wording import clock, is_number, number, percent, typeset, words
from groundstation.reports.figures import forecast as forecast_figures
from groundstation.reports.sections.saved import mapping, not_assessable_reason, objects
from groundstation.results.files import SavedFlight
from groundstation.results.forecast import FEWEST_STARTS, METHODS, honesty

HONEST = (0.90, 0.98)  # shares inside the 95 % band that pass for it
SAME = 0.03  # two RMS values closer than this are not told apart
HEADLINE_MIN = 60.0  # the horizon the conclusion quotes, or the longest there is
HONESTY_TONES: dict[str, Tone] = {"within limits": "good", "too sure": "warn"}
COMPARED = ("last_estimate", "windows")  # beside the shipped method in the calibration table
LEAD = (
    "GNSS taken away at many moments of this flight, on paper: the errors the filter forecast from there, against what "
    "GNSS then showed. Error: radial position error built up since the start, position known there."
)


def build(saved: SavedFlight) -> Section | None:
    """Build the chapter; None when the flight was not assessed and no reason is known."""
    forecast = mapping(saved.summary, "results", "forecast")
    if not forecast:
        reason = not_assessable_reason(saved, "forecast")
        note = Note(f"Not assessable: {reason}", "unknown")
        return Section("forecast", "Forecast without GNSS", LEAD, (note,)) if reason else None
    default = str(forecast.get("default_method") or "")
    parts: tuple[Part | None, ...] = (
        *_conclusions(saved, forecast),
        _skill(forecast),
        forecast_figures.growth(saved, default),
        _default_in_detail(forecast),
        forecast_figures.calibration(objects(forecast, "calibration"), default),
        *_calibration(forecast),
        forecast_figures.hindcast_map(saved, default),
        forecast_figures.classic(saved),
        _classic(forecast),
        _gaps(forecast),
        _phases(forecast),
        _coupled(forecast),
    )
    return Section("forecast", "Forecast without GNSS", LEAD, tuple(part for part in parts if part is not None))


# ---------------------------------------------------------------------------------------------------- in words


def _conclusions(saved: SavedFlight, forecast: Mapping[str, Any]) -> list[Note]:
    """What the chapter comes to: skill, honesty, windows; a sentence each."""
    kind = mapping(saved.summary, "results", "inertial").get("kind")
    if kind == "gnss_aided":
        text = "The INS is aided by GNSS: what follows shows how it follows GNSS, and nothing about a forecast."
        return [Note(text, "warn")]
    text = "Whether GNSS corrects this INS already cannot be told: if it does, what follows says nothing of a forecast."
    notes = [
        Note(text, "unknown") if kind == "unknown" else None,
        _gain(forecast),
        _honesty(forecast),
        _windows(forecast),
    ]
    return [note for note in notes if note is not None]


def _rows(forecast: Mapping[str, Any], method: str) -> dict[float, Mapping[str, Any]]:
    """Skill rows of a method by horizon, those that have an error."""
    return {
        float(row["horizon_min"]): row
        for row in objects(forecast, "skill")
        if row.get("method") == method and is_number(row.get("horizon_min")) and is_number(row.get("rms_m"))
    }


def _gain(forecast: Mapping[str, Any]) -> Note | None:
    default = str(forecast.get("default_method") or "")
    shipped, raw = _rows(forecast, default), _rows(forecast, "raw_ins")
    shared = sorted(set(shipped) & set(raw))
    if not shared:
        return None
    horizon = HEADLINE_MIN if HEADLINE_MIN in shared else shared[-1]
    ours, theirs = shipped[horizon]["rms_m"], raw[horizon]["rms_m"]
    better = [lead for lead in shared if shipped[lead]["rms_m"] < raw[lead]["rms_m"]]
    text = (
        f"After {horizon:g} min without GNSS the shipped method ({title_of(default)}) is off by {number(ours, 0, 'm')} "
        f"RMS, the raw INS by {number(theirs, 0, 'm')}, over {number(shipped[horizon].get('starts'), 0)} starts; it "
    )
    text += f"beats the raw INS {_where(better, shared)}."
    return Note(text, "good" if len(better) == len(shared) else "warn")


def _honesty(forecast: Mapping[str, Any]) -> Note | None:
    reason = typeset(str(forecast.get("calibration_reason") or "")).strip().rstrip(".")
    default = _rows(forecast, str(forecast.get("default_method") or ""))
    few = _too_few(forecast)
    known = {lead: row["coverage95"] for lead, row in default.items() if is_number(row.get("coverage95"))}
    shares = {lead: share for lead, share in known.items() if lead not in few}
    start = (
        "" if forecast.get("is_calibrated") else f"Not calibrated: {reason or 'too little data before the outage'}. "
    )
    unjudged = [lead for lead in known if lead in few]
    why = f"fewer than {FEWEST_STARTS} independent starts"
    if not shares:
        text = f"{start}Whether its σ is honest cannot be judged: {why}." if unjudged else start.strip()
        return Note(text, "warn" if start else "unknown") if text else None
    left = f" {_where(unjudged, list(known)).capitalize()} too few to judge: {why}." if unjudged else ""
    low, high = percent(min(shares.values())), percent(max(shares.values()))
    held = low if low == high else f"{low} to {high} (by horizon)"
    text = f"{start}The 95 % band of the forecast held {held} of the errors: "
    narrow = [lead for lead, share in shares.items() if share < HONEST[0]]
    wide = [lead for lead, share in shares.items() if share > HONEST[1]]
    if not narrow and not wide:
        return Note(f"{text}the σ it claims is honest on this flight.{left}", "warn" if start else "good")
    told = [
        f"too narrow {_where(narrow, list(known))}" if narrow else "",
        f"wider than needed {_where(wide, list(known))}" if wide else "",
    ]
    return Note(text + " and ".join(filter(None, told)) + f".{left}", "warn")


def _too_few(forecast: Mapping[str, Any]) -> set[float]:
    """Horizons at which the shipped method has too few independent starts for a judgement."""
    return {
        float(row["horizon_min"])
        for row in objects(forecast, "calibration")
        if row.get("method") == forecast.get("default_method")
        and is_number(row.get("horizon_min"))
        and is_number(row.get("independent_starts"))
        and row["independent_starts"] < FEWEST_STARTS
    }


def _windows(forecast: Mapping[str, Any]) -> Note | None:
    """Whether the paper's windows help on this flight."""
    windows, last = _rows(forecast, "windows"), _rows(forecast, "last_estimate")
    shared = sorted(set(windows) & set(last))
    if not shared:
        return None
    pairs = {lead: (windows[lead]["rms_m"], last[lead]["rms_m"]) for lead in shared}
    helped = [lead for lead, (ours, theirs) in pairs.items() if ours < (1.0 - SAME) * theirs]
    hurt = [lead for lead, (ours, theirs) in pairs.items() if ours > (1.0 + SAME) * theirs]
    told = [_at(verb, leads, pairs) for verb, leads in (("help", helped), ("hurt", hurt)) if leads]
    sentence = "The paper's long-period windows " + (" and ".join(told) if told else "change nothing on this flight")
    return Note(f"{sentence}. One flight decides nothing: starts overlap.", "plain")


def _at(verb: str, leads: Sequence[float], pairs: Mapping[float, tuple[float, float]]) -> str:
    windows, last = pairs[leads[-1]]
    example = f"at {leads[-1]:g} min {number(windows, 0, 'm')} against {number(last, 0, 'm')} of the last estimate"
    return f"{verb} {_where(leads, list(pairs))} ({example})"


def _where(some: Sequence[float], every: Sequence[float]) -> str:
    if not some:
        return "at no horizon"
    return "at every horizon" if len(some) == len(every) else f"at {listed(some)} min"


def listed(values: Sequence[float]) -> str:
    """Numbers in a row of words.

    Examples
    --------
    >>> listed([30.0, 60.0, 90.0]), listed([1.0])
    ('30, 60 and 90', '1')
    """
    texts = [f"{value:g}" for value in sorted(values)]
    return texts[0] if len(texts) == 1 else ", ".join(texts[:-1]) + f" and {texts[-1]}"


def short(method: str) -> str:
    """Name of a method for the head of a column.

    Examples
    --------
    >>> short("raw_ins"), short("last_estimate")
    ('raw INS', 'last estimate')
    """
    return " ".join("INS" if word == "ins" else word for word in words(method).split())


def title_of(method: str) -> str:
    """Title of a method for people."""
    return METHODS.get(method, method)


# ---------------------------------------------------------------------------------------------------- tables


def _skill(forecast: Mapping[str, Any]) -> Grid | None:
    rows = objects(forecast, "skill")
    horizons = sorted({float(row["horizon_min"]) for row in rows if is_number(row.get("horizon_min"))})
    methods = [name for name in METHODS if _rows(forecast, name)]
    if not horizons or not methods:
        return None
    best, default = mapping(forecast, "best_method"), str(forecast.get("default_method"))
    out: list[list[Cell]] = []
    for name in methods:
        mine = _rows(forecast, name)
        title = title_of(name) + (" (shipped)" if name == default else "")
        cells = [_rms(mine.get(lead), best.get(f"{lead:g}") == name) for lead in horizons]
        out.append([title, *cells])
    shipped = _rows(forecast, default)
    out.append(["Starts", *(number(shipped.get(lead, {}).get("starts"), 0) for lead in horizons)])
    heads = (Head("RMS radial error, m"), *(Head(f"{lead:g} min", True) for lead in horizons))
    step = number(forecast.get("start_step_s"), 0, "s")
    caption = (
        f"Starts every {step} from {clock(forecast.get('first_start_s'))} of flight time on, as far as each horizon "
        "fits; ✓ the least on this flight. Neighbouring starts share most of their data."
    )
    return Grid("Skill by method and horizon", heads, out, caption, ("forecast_growth",))


def _rms(row: Mapping[str, Any] | None, is_best: bool) -> Cell:
    text = number(row.get("rms_m") if row else None, 0)
    return Mark("good", text) if is_best else text


def _default_in_detail(forecast: Mapping[str, Any]) -> Grid | None:
    rows = [
        (
            f"{lead:g} min",
            number(row.get("starts"), 0),
            number(row.get("rms_m"), 0),
            number(row.get("median_m"), 0),
            number(row.get("p95_m"), 0),
            percent(row.get("coverage95")),
            percent(row.get("coverage95_model")),
        )
        for lead, row in sorted(_rows(forecast, str(forecast.get("default_method"))).items())
    ]
    titles = ("Starts", "RMS, m", "Median, m", "95 %, m", "In 95 % band", "Before scaling")
    heads = (Head("Horizon"), *(Head(title, True) for title in titles))
    caption = "Short term: up to 10 min; long term: beyond. Before scaling: with the σ of the model as it comes."
    return Grid("The shipped method in detail", heads, rows, caption) if rows else None


def _calibration(forecast: Mapping[str, Any]) -> list[Grid]:
    """A table for each method compared: the shipped one first."""
    grids = []
    titles = ("Starts", "Independent", "In 50 %", "In 68 %", "In 95 %", "NEES", "95 % limits", "σ scale")
    heads = (Head("Horizon"), *(Head(title, True) for title in titles), Head("NEES is"))
    caption = (
        "NEES: mean squared error over the variance claimed, 1 is honest; its 95 % limits come from the number of "
        f"independent starts, and below {FEWEST_STARTS} of those nothing is judged. σ scale: what the model's σ was "
        "multiplied by."
    )
    for name in dict.fromkeys((str(forecast.get("default_method")), *COMPARED)):
        rows = [_calibration_cells(row) for row in objects(forecast, "calibration") if row.get("method") == name]
        if rows:
            grids.append(
                Grid(f"Is the claimed σ honest? {short(name)[:1].upper()}{short(name)[1:]}", heads, rows, caption)
            )
            caption = ""
    return grids


def _calibration_cells(row: Mapping[str, Any]) -> tuple[Cell, ...]:
    nees, low, high, independent = (row.get(key) for key in ("nees", "nees_low", "nees_high", "independent_starts"))
    state: Cell = ""
    if is_number(nees) and is_number(low) and is_number(high) and is_number(independent):
        text = honesty(int(independent), nees, low, high)
        state = Mark(HONESTY_TONES.get(text, "unknown"), text)
    return (
        number(row.get("horizon_min"), 0, "min"),
        number(row.get("starts"), 0),
        number(independent, 0),
        *(percent(row.get(key)) for key in ("inside50", "inside68", "inside95")),
        number(nees, 2),
        f"{number(low, 2)} … {number(high, 2)}",
        number(row.get("scale"), 2),
        state,
    )


def _classic(forecast: Mapping[str, Any]) -> Grid | None:
    rows = objects(forecast, "classic_starts")
    methods = list(dict.fromkeys(str(row.get("method")) for row in rows))
    leads = sorted({float(row["horizon_min"]) for row in rows if is_number(row.get("horizon_min"))})
    starts = sorted({float(row["start_h"]) for row in rows if is_number(row.get("start_h"))})
    errors = {(row.get("start_h"), row.get("horizon_min"), row.get("method")): row.get("error_m") for row in rows}
    out = [
        (f"{start:g} h", f"{lead:g} min", *(number(errors.get((start, lead, name)), 0) for name in methods))
        for start in starts
        for lead in leads
        if any((start, lead, name) in errors for name in methods)
    ]
    heads = (Head("Start"), Head("Horizon", True), *(Head(short(name), True) for name in methods))
    caption = "Radial error, m. The later the start, the longer the filter has watched: compare equal horizons."
    return Grid("The four starts of the paper", heads, out, caption) if out else None


def _gaps(forecast: Mapping[str, Any]) -> Grid | None:
    rows = objects(forecast, "gaps")
    lengths = sorted({float(row["length_min"]) for row in rows if is_number(row.get("length_min"))})
    found = {(row.get("length_min"), row.get("method")): row for row in rows}
    out = []
    for length in lengths:
        forward, rts = found.get((length, "forward"), {}), found.get((length, "rts"), {})
        starts = forward.get("starts", rts.get("starts"))
        cells = (number(part.get("max_error_rms_m"), 0) for part in (forward, rts))
        shares = (percent(part.get("coverage95")) for part in (forward, rts))
        out.append((f"{length:g} min", number(starts, 0), *cells, *shares))
    titles = ("Gaps", "Forward, m", "RTS, m", "Forward in 95 %", "RTS in 95 %")
    heads = (Head("Length"), *(Head(title, True) for title in titles))
    caption = (
        "Largest radial error in each gap, RMS over the gaps. Forward: forecast, for use on board; RTS: smoothed with "
        "what came after, for the reference trajectory."
    )
    return Grid("Gaps with GNSS on both sides", heads, out, caption) if out else None


def _phases(forecast: Mapping[str, Any]) -> Grid | None:
    rows = [
        (
            str(row.get("phase", "")),
            clock(row.get("length_s")),
            number(row.get("starts"), 0),
            number(row.get("rms_m"), 1),
            number(row.get("raw_rms_m"), 1),
        )
        for row in objects(forecast, "phases")
    ]
    titles = ("Length", "Starts", "Shipped, RMS m", "Raw INS, RMS m")
    heads = (Head("Begins in"), *(Head(title, True) for title in titles))
    caption = (
        "Lengths in min:s. These starts are not those of the table of skill: they come every 60 s from 10 min after "
        "the first epoch on, when the filter has hardly settled, so the numbers differ from the skill at equal lengths."
    )
    return Grid("Outages by phase of flight", heads, rows, caption) if rows else None


def _coupled(forecast: Mapping[str, Any]) -> Grid | None:
    rows = [
        (number(row.get("horizon_min"), 0, "min"), number(row.get("rms_m"), 0), _signed_percent(row.get("gain")))
        for row in objects(forecast, "coupled")
    ]
    heads = (Head("Horizon"), Head("Coupled, RMS m", True), Head("Gain", True))
    caption = (
        "Fourteen states (six of each channel, coupled, azimuth and its drift) against two separate channels; last "
        "estimate of both."
    )
    return Grid("Coupled model", heads, rows, caption) if rows else None


def _signed_percent(share: Any) -> str:
    return number(100.0 * share if is_number(share) else None, 0, "%", signed=True)
