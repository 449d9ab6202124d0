"""Chapter on navigation between aircraft: which algorithm to trust, and why.

How good it is, and on what it rests.
"""

from collections.abc import Mapping

from groundstation.chapters.assessed import reason_of, without_answer
from groundstation.chapters.gates import NOT_ASSESSABLE
from groundstation.chapters.parts import Cell, Facts, Figure, Front, Grid, Head, Mark, Note, Part, Section
from groundstation.chapters.wording import (
    any_value,
    duration,
    is_number,
    named_quantity,
    names_or_count,
    number,
    significant,
    with_full_stop,
    words,
)
from groundstation.results.arrays.session import SessionClocks
from groundstation.results.fleet import SessionRow
from groundstation.results.flight import FlightResults
from groundstation.systems.cooperative.answer import AlgorithmRow, CooperativeResult, LinkRow
from groundstation.systems.cooperative.stations_chapter import stations_parts, stations_warning

TITLE = "Navigation between aircraft"
LEAD = (
    "Positions of all aircraft from their own dead reckoning and the ranges between them. The smoothed answer uses all "
    "readings of the session at every time; the filters beside it tell what was knowable on board. 2σ_r is twice the "
    "root of the summed variances north and east, as each algorithm computes it."
)
TITLES: Mapping[str, str] = {
    "dead_reckoning": "Dead reckoning alone",
    "centralised": "Centralised: one filter of all",
    "neighbour_exact": "Neighbour taken as exact",
    "ranked": "Ranked (multilevel)",
    "modified": "Ranked, noise of the primaries correlated",
    "split_intersection": "Split covariance intersection",
    "pairwise": "Stored pairwise covariances",
    "smoothed": "Smoothed over the whole session",
}
REFERENCE = "dead_reckoning"
MOST_LINKS = 40
ALGORITHM_HEADS = (
    *(Head("Algorithm"), Head("2σ_r, session, m", True), Head("2σ_r, end, m", True), Head("RMS error, m", True)),
    *(Head("RMS over the bound", True), Head("NEES (95 % limits)", True), Head("Consistent"), Head("Diverges")),
)
COST_HEADS = (
    *(Head("Algorithm"), Head("Update"), Head("Spectral radius", True), Head("Used", True), Head("Gated", True)),
    Head("Lost", True),
    *(Head("Messages", True), Head("Bytes per slot", True)),
)
COST_CAPTION = (
    "Spectral radius of the joint error map, worst window: above 1 errors grow. Messages and bytes are what a data "
    "link would carry for the algorithm."
)
ALGORITHM_CAPTION = (
    "2σ_r of the worst aircraft: over the session (root mean square) and at its end. NEES: squared error over its "
    "computed variance, 2 is honest; the limits count aircraft, not epochs. Diverges: "
    "error above three computed σ_r at the end. The bound is that of Cramér and Rao for this geometry, from the "
    "readings that the algorithm may use."
)
VEHICLE_HEADS = (
    *(Head("Aircraft"), Head("σ north, m", True), Head("σ east, m", True), Head("2σ_r, m", True)),
    *(Head("RMS error, m", True), Head("Error at the end, m", True), Head("NEES", True), Head("Link clock, m", True)),
)
GEOMETRY_HEADS = (
    *(Head("Aircraft"), Head("Sources", True), Head("HDOP", True), Head("GDOP", True), Head("det(H'H)", True)),
    *(Head("least det", True), Head("least eigenvalue", True), Head("Gram determinant", True)),
)
GEOMETRY_CAPTION = "Medians over the session unless noted; det(H'H) of two sources is sin² of their angle."
LINK_HEADS = (
    *(Head("Receiver"), Head("Source"), Head("Ranges", True), Head("Used", True), Head("Gated", True)),
    *(Head("Residual, mean, m", True), Head("RMS, m", True), Head("NIS", True)),
)
CLOCK_HEADS = (
    *(Head("Aircraft"), Head("Log"), Head("UTC"), Head("Ranges", True), Head("Offset, s", True), Head("Leaps", True)),
    Head("Offset removed"),
)


def cooperative(results: FlightResults) -> Section | None:
    """Return the chapter on a session; None for results of one flight."""
    answer = results.answer(CooperativeResult)
    if answer is None:
        return without_answer(results, "cooperative", TITLE, LEAD)
    best = trusted(answer)
    warning = stations_warning(answer)
    above = (*((Note(warning, "warn"),) if warning else ()), _advice(answer, best))
    parts: list[Part | None] = [
        _algorithms(answer, best),
        *stations_parts(answer),
        _costs(answer),
        Figure("cooperative.map"),
        _vehicles(answer, best),
        Figure("cooperative.errors"),
        _geometry(answer),
        Figure("cooperative.geometry"),
        _links(answer),
        Figure("cooperative.links"),
        _clocks(results),
        _settings(answer),
    ]
    kept = tuple(part for part in parts if part is not None)
    return Section("cooperative", TITLE, LEAD, kept, headline=_headline(best), above=above)


def trusted(answer: CooperativeResult) -> AlgorithmRow:
    """Return the algorithm to trust.

    The default, unless the truth speaks against it: then, of those that neither diverge nor claim less error than they
    make, the one with the least error, where there is any. One session is too little to choose by its error alone. Dead
    reckoning only where nothing else ran.
    """
    able = [row for row in answer.algorithms if not row.refused]
    ran = [row for row in able if row.algorithm != REFERENCE] or able
    default = next((row for row in ran if row.algorithm == answer.default_algorithm), ran[0])
    sound = [row for row in ran if _is_safe(row)]
    if default in sound or not sound:
        return default
    return min(sound, key=lambda row: (row.rms_m or 0.0, row.algorithm))


def _is_safe(row: AlgorithmRow) -> bool:
    """Tell whether truth shows neither divergence nor a sigma that is too small.

    A sigma that is too large misleads nobody.
    """
    if row.nees is None or row.nees_high is None:
        return False
    return row.diverges is False and row.nees <= row.nees_high


def title_of(algorithm: str) -> str:
    """Return the name of an algorithm for people."""
    return TITLES.get(algorithm, words(algorithm))


def in_text(algorithm: str) -> str:
    """Return that name within a sentence."""
    title = title_of(algorithm)
    return f"{title[:1].lower()}{title[1:]}"


def state_of(row: AlgorithmRow | SessionRow) -> Mark:
    """Return the judgement of truth on an algorithm, in a word."""
    if row.diverges is None or row.is_consistent is None:
        return Mark("unknown", "Not judged")
    if row.diverges:
        return Mark("bad", "Diverges")
    return Mark("good", "Consistent") if row.is_consistent else Mark("warn", "Not consistent")


def session_front(results: FlightResults, pairs: tuple[tuple[str, Cell], ...]) -> Front:
    """Return the top of a session's report: what was found, or why nothing."""
    answer = results.answer(CooperativeResult)
    if answer is None:
        why = reason_of(results, "cooperative") or "the logs do not hold what the method needs"
        headline = f"{TITLE}: not assessable"
        return Front(
            f"Session of {results.metadata['aircraft']}", pairs, NOT_ASSESSABLE, headline, (with_full_stop(why),)
        )
    best, reckoned = trusted(answer), _row(answer, REFERENCE)
    at_end = f"worst aircraft over the session, as computed; {_metres(best.two_sigma_r_m, 'm')} at its end"
    figures = [("2σ_r", _metres(best.two_sigma_r_session_m, "m"), at_end)]
    if reckoned is not None and reckoned is not best:
        figures.append(
            (
                "Dead reckoning alone",
                _metres(reckoned.two_sigma_r_session_m, "m"),
                "2σ_r, worst aircraft over the session, as computed",
            )
        )
    if is_number(best.rms_m):
        limits = f"NEES {number(best.nees, 2)}, 95 % limits {number(best.nees_low, 2)} to {number(best.nees_high, 2)}"
        figures.append(("RMS error", _metres(best.rms_m, "m"), limits))
        figures.append(("Over the bound", number(best.bound_ratio, 2), "RMS error over that of Cramér and Rao"))
    on_board = _row(answer, answer.links_algorithm)
    if on_board is not None and on_board is not best:
        figures.append(
            (
                "Knowable on board",
                _metres(on_board.two_sigma_r_session_m, "m"),
                f"2σ_r, {in_text(on_board.algorithm)}; {_metres(on_board.two_sigma_r_m, 'm')} at the end",
            )
        )
    if best.messages:
        figures.append(("Data link", number(best.bytes_per_slot, 0, "bytes"), "per slot, for this algorithm"))
    return Front(
        f"Session of {names_or_count(answer.vehicle_names)}",
        pairs,
        verdict=state_of(best),
        headline=f"{title_of(best.algorithm)}: 2σ_r {_metres(best.two_sigma_r_session_m, 'm')}",
        sentences=tuple(text for text in (stations_warning(answer), _reason(answer, best)) if text),
        figures=tuple(figures),
    )


def _headline(best: AlgorithmRow) -> str:
    mark, error = state_of(best), f", RMS {_metres(best.rms_m, 'm')}" if is_number(best.rms_m) else ""
    return f"{mark.symbol} {title_of(best.algorithm)} · 2σ_r {_metres(best.two_sigma_r_session_m, 'm')}{error}"


def _row(answer: CooperativeResult, algorithm: str) -> AlgorithmRow | None:
    return next((row for row in answer.algorithms if row.algorithm == algorithm), None)


def _reason(answer: CooperativeResult, best: AlgorithmRow) -> str:
    name = title_of(best.algorithm)
    if best.rms_m is None:
        return (
            f"{name} is the algorithm to trust by design: no log holds a truth, so neither the errors nor the computed "
            "sigma can be checked."
        )
    if not _is_safe(best):
        return (
            f"Against the truth every algorithm diverges or is overconfident; {name} is the default, but do not trust "
            "its sigma."
        )
    if best.algorithm != answer.default_algorithm:
        return (
            f"{name} has the least error of the algorithms that neither diverge nor are overconfident; the default, "
            f"{in_text(answer.default_algorithm)}, is not among them."
        )
    if best.is_consistent:
        return f"{name}: its errors against the truth are consistent with its computed sigma, and it does not diverge."
    return f"{name}: its errors against the truth are smaller than its computed sigma says, and it does not diverge."


def _advice(answer: CooperativeResult, best: AlgorithmRow) -> Note:
    return Note(_reason(answer, best), state_of(best).tone)


def _algorithms(answer: CooperativeResult, best: AlgorithmRow) -> Grid:
    rows = []
    for row in answer.algorithms:
        limits = "" if row.nees is None else f" ({number(row.nees_low, 2)} to {number(row.nees_high, 2)})"
        rows.append(
            (
                Mark("good" if row is best else "plain", title_of(row.algorithm)),
                "refused" if row.refused else _metres(row.two_sigma_r_session_m),
                _metres(row.two_sigma_r_m),
                _metres(row.rms_m),
                number(row.bound_ratio, 2),
                number(row.nees, 2) + limits,
                _no_truth(row) if row.is_consistent is None else _yes_no(row.is_consistent, is_good=True),
                _no_truth(row) if row.diverges is None else _yes_no(row.diverges, is_good=False),
            )
        )
    refused = "".join(f" {title_of(row.algorithm)}, {row.refused}." for row in answer.algorithms if row.refused)
    return Grid("Algorithms", ALGORITHM_HEADS, rows, ALGORITHM_CAPTION + refused, ("cooperative_tracks",))


def _costs(answer: CooperativeResult) -> Grid:
    rows = [
        (
            title_of(row.algorithm),
            row.update,
            number(row.spectral_radius, 3),
            number(row.accepted, 0),
            number(row.gated, 0),
            number(row.lost, 0),
            number(row.messages, 0),
            number(row.bytes_per_slot, 0),
        )
        for row in answer.algorithms
        if not row.refused
    ]
    numbers_of = ("cooperative_map", "cooperative_traffic")
    return Grid("Stability, measurements and data link", COST_HEADS, rows, COST_CAPTION, numbers_of)


def _no_truth(row: AlgorithmRow) -> Mark:
    return Mark("unknown", "not run" if row.refused else "no truth")


def _metres(value: float | None, unit: str = "", *, signed: bool = False) -> str:
    """Return a length in metres, to the millimetre below one metre: robots, not aircraft."""
    is_small = value is not None and abs(value) < 1.0
    return number(value, 3 if is_small else 1, unit, signed=signed)


def _yes_no(value: bool, is_good: bool) -> Mark:
    return Mark("good" if value is is_good else "bad", "yes" if value else "no")


def _vehicles(answer: CooperativeResult, best: AlgorithmRow) -> Grid:
    rows = [
        (
            row.vehicle,
            _metres(row.sigma_north_m),
            _metres(row.sigma_east_m),
            _metres(row.two_sigma_r_m),
            _metres(row.rms_m),
            _metres(row.end_error_m),
            number(row.nees, 2),
            number(row.clock_m, 1, signed=True),
        )
        for row in answer.vehicles
        if row.algorithm == best.algorithm
    ]
    return Grid(f"Aircraft, {in_text(best.algorithm)}", VEHICLE_HEADS, rows, numbers=("cooperative_tracks",))


def _geometry(answer: CooperativeResult) -> Grid | None:
    rows = [
        (
            row.vehicle,
            number(row.sources_median, 1),
            number(row.hdop_median, 2),
            number(row.gdop_median, 2),
            significant(row.determinant_median),
            significant(row.determinant_least),
            significant(row.eigenvalue_least),
            significant(row.gram_determinant_median),
        )
        for row in answer.geometry
    ]
    return Grid("Geometry", GEOMETRY_HEADS, rows, GEOMETRY_CAPTION, ("cooperative_geometry",)) if rows else None


def worst_first(links: tuple[LinkRow, ...]) -> list[LinkRow]:
    """Return links by residual, largest first; links without a used range come before them."""
    return sorted(links, key=lambda row: (row.used > 0, -(row.residual_rms_m or 0.0), row.receiver, row.source))


def _links(answer: CooperativeResult) -> Grid | None:
    ordered = worst_first(answer.links)
    rows = [
        (
            row.receiver,
            row.source if row.kind != "point" else f"{row.source} (station)",
            number(row.ranges, 0),
            number(row.used, 0),
            Mark("warn", number(row.gated, 0)) if row.gated else number(row.gated, 0),
            _metres(row.residual_mean_m, signed=True),
            _metres(row.residual_rms_m),
            number(row.nis, 2),
        )
        for row in ordered[:MOST_LINKS]
    ]
    caption = (
        f"Residuals of the ranges as predicted by {in_text(answer.links_algorithm)}, worst first; NIS: squared "
        "residual over its computed variance, 1 is honest."
    )
    if len(ordered) > len(rows):
        caption += f" {len(ordered) - len(rows)} more in summary.json."
    return Grid("Links", LINK_HEADS, rows, caption, ("cooperative_links",)) if rows else None


def _clocks(results: FlightResults) -> Grid | None:
    data = results.rows_of(SessionClocks)
    if data is None:
        return None
    caption = "Offset: log time minus time of transmission and travel, against the group; absent without UTC or ranges."
    return Grid("Clocks of the logs", CLOCK_HEADS, _clock_rows(data), caption, ("session_clocks",))


def _clock_rows(data: SessionClocks) -> list[tuple[str | Mark, ...]]:
    columns = zip(
        data.aircraft,
        data.log,
        data.has_utc,
        data.ranges,
        data.offset_s,
        data.leaps,
        data.is_corrected,
        strict=True,
    )
    return [
        (
            str(aircraft),
            str(log),
            "yes" if has_utc else "no",
            number(float(ranges), 0),
            number(float(offset), 6, signed=True),
            Mark("warn", number(float(leaps), 0)) if leaps else number(float(leaps), 0),
            Mark("warn", "yes") if corrected else "no",
        )
        for aircraft, log, has_utc, ranges, offset, leaps, corrected in columns
    ]


def _settings(answer: CooperativeResult) -> Facts:
    pairs = [
        ("frame", answer.frame, ""),
        ("duration", duration(answer.duration_s), ""),
        ("slots", str(answer.slots), ""),
    ]
    for name, value in answer.settings.items():
        label, unit = named_quantity(name.replace(".", " "))
        pairs.append((label, any_value(value, unit), ""))
    return Facts("Settings as used", pairs, compact=True)
