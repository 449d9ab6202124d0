"""Study of the learned installation on fleets of docs/evidence/installation.md.

Coverage, half widths, acceptance.
"""

import time
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.chapters.parts import Section
from groundstation.results.figures import FigureData
from groundstation.systems.heading.installation.answer import InstallationResult
from groundstation.systems.heading.installation.series import answers_of, series_of
from groundstation.systems.heading.installation.settings import InstallationSettings
from groundstation.systems.heading.study.installation_family import (
    AIRCRAFT,
    FAMILIES,
    FLIGHTS,
    LIMIT_DEG,
    FlownFlight,
    draw_fleet,
)
from groundstation.systems.heading.study.installation_pool import Progress, TaxiOfPool, draw_pool, pool_figure
from groundstation.systems.study import RunStore, StudyResult, section, table

LEAST_POOL = FLIGHTS
ORDER = [family.name for family in FAMILIES]
CHANGING = frozenset(family.name for family in FAMILIES if family.change)


@dataclass(frozen=True)
class JudgedFlight:
    """One flight of a fleet against the truth; errors are estimate minus truth, degrees.

    ``flight`` counts from 1, ``taught`` earlier flights taught, another unit first flew ``since`` flights ago.
    """

    family: str
    flight: int
    taught: int
    since: int
    passes_standstill: bool
    verdict: str
    error_deg: float
    half_width_deg: float
    is_inside: bool
    platform_error_deg: float
    platform_half_width_deg: float
    is_platform_inside: bool
    alone_half_width_deg: float


def study_installation(
    runs: int = 200,
    seed: int = 71,
    progress: Progress | None = None,
    *,
    kept: RunStore[TaxiOfPool] | None = None,
    minutes: float | None = None,
) -> StudyResult:
    """Draw fleets of every family and judge each flight by what earlier ones taught.

    Parameters
    ----------
    runs : int
        Taxis of the pool, each through the whole estimator.
    seed : int
        Of pool and fleets.
    progress : callable, optional
    kept : RunStore, optional
        Taxis of an earlier call.
    minutes : float, optional
        Time after which no further taxi is drawn; the fleets are then made of those there are.
    """
    end_s = np.inf if minutes is None else time.monotonic() + 60.0 * minutes
    least = LEAST_POOL

    def is_over() -> bool:
        nonlocal least
        least -= 1
        return least < 0 and time.monotonic() > end_s

    pool = draw_pool(seed, runs, progress, kept=kept, is_over=is_over)
    judged: list[JudgedFlight] = []
    for number, family in enumerate(FAMILIES):
        if progress is not None:
            progress(f"family {family.name}")
        judged += judge_family(number, seed, pool)
    tables = (
        table_by(judged, "flight", "installation_flights"),
        table_by([one for one in judged if one.family in CHANGING], "since", "installation_changes"),
        pool_table(pool),
        pool_figure(pool),
    )
    return StudyResult("installation", tables, _page(tables, seed, len(pool)))


def judge_family(
    number: int,
    seed: int,
    pool: Sequence[TaxiOfPool],
    settings: InstallationSettings | None = None,
    aircraft: int = AIRCRAFT,
) -> list[JudgedFlight]:
    """Judge every flight of the fleets of a family."""
    settings = settings or InstallationSettings()
    found = []
    for flights in draw_fleet(number, seed, pool, aircraft):
        flown = {one.lesson.flight_id: (place, one) for place, one in enumerate(flights, 1)}
        for series in series_of(one.lesson for one in flights):
            for lesson, answer in answers_of(series, settings):
                assert answer is not None
                found.append(_judged(FAMILIES[number].name, *flown[lesson.flight_id], answer))
    return found


def _judged(family: str, place: int, flown: FlownFlight, answer: InstallationResult) -> JudgedFlight:
    platform_deg = answer.platform_error_deg
    assert platform_deg is not None
    platform_ends = answer.platform_confidence95_deg or (np.nan, np.nan)
    return JudgedFlight(
        family,
        place,
        answer.flights,
        flown.since_change,
        flown.taxi.passes_standstill,
        answer.verdict,
        float(wrap_180(answer.error_deg - flown.airframe_deg)),
        answer.half_width_deg,
        _holds(answer.confidence95_deg, flown.airframe_deg),
        float(wrap_180(platform_deg - flown.platform_deg)),
        float(np.max(np.abs(np.array(platform_ends) - platform_deg))),
        _holds(platform_ends, flown.platform_deg),
        flown.lesson.half_width_deg,
    )


def _holds(ends_deg: tuple[float, float], truth_deg: float) -> bool:
    middle = 0.5 * (ends_deg[0] + ends_deg[1])
    return abs(float(wrap_180(truth_deg - middle))) <= 0.5 * (ends_deg[1] - ends_deg[0])


def table_by(judged: Sequence[JudgedFlight], by: str, name: str) -> FigureData:
    """Tabulate one row for each family and each value of ``by``.

    ``by``: the number of the flight, or of flights since a change.
    """
    found: dict[tuple[str, int], list[JudgedFlight]] = {}
    for one in sorted(judged, key=lambda one: (ORDER.index(one.family), getattr(one, by))):
        found.setdefault((one.family, getattr(one, by)), []).append(one)
    groups = list(found.items())
    columns: dict[str, np.ndarray] = {
        "family": np.array([key[0] for key, _ in groups]),
        by: np.array([key[1] for key, _ in groups]),
        "flights": np.array([len(mine) for _, mine in groups]),
    }
    figures: dict[str, Callable[[Sequence[JudgedFlight]], float]] = {
        "coverage": lambda mine: _share(one.is_inside for one in mine),
        "half_width_arcmin": lambda mine: _median(one.half_width_deg for one in mine),
        "alone_arcmin": lambda mine: _median(one.alone_half_width_deg for one in mine),
        "accepted": lambda mine: _share(one.verdict == "accept" for one in mine),
        "accepted_of_those_whose_standstill_passes": lambda mine: _share(
            one.verdict == "accept" for one in mine if one.passes_standstill
        ),
        "accepted_beyond_limit": lambda mine: _share(
            abs(one.error_deg) > LIMIT_DEG for one in mine if one.verdict == "accept"
        ),
        "platform_coverage": lambda mine: _share(
            one.is_platform_inside for one in mine if np.isfinite(one.platform_half_width_deg)
        ),
        "platform_half_width_arcmin": lambda mine: _median(one.platform_half_width_deg for one in mine),
        "platform_half_width_within_20": lambda mine: _share(one.platform_half_width_deg <= LIMIT_DEG for one in mine),
        "platform_error_within_20": lambda mine: _share(abs(one.platform_error_deg) <= LIMIT_DEG for one in mine),
    }
    columns |= {key: np.array([of(mine) for _, mine in groups]) for key, of in figures.items()}
    digits = {key: 1 if key.endswith("arcmin") else 3 for key in figures}
    return FigureData(name, columns, digits)


def pool_table(pool: Sequence[TaxiOfPool]) -> FigureData:
    """Tabulate errors, half widths and failed gates of the pool."""
    errors, halves = (np.array([getattr(one, name) for one in pool]) for name in ("error_deg", "half_width_deg"))
    rows = [
        ("rms error, arcmin", float(np.sqrt(np.mean(errors**2))) * ARCMIN_PER_DEG),
        ("median half width by this taxi alone, arcmin", float(np.median(halves)) * ARCMIN_PER_DEG),
        ("coverage by this taxi alone", float(np.mean(np.abs(errors) <= halves))),
        ("standstill passes, share", _share(one.passes_standstill for one in pool)),
    ]
    names = sorted({name for one in pool for name in one.failed})
    rows += [(f"gate {name} fails, share", _share(name in one.failed for one in pool)) for name in names]
    columns = {"figure": np.array([row[0] for row in rows]), "value": np.array([row[1] for row in rows])}
    return FigureData("installation_taxis", columns, {"value": 3})


def _share(flags: Iterable[bool]) -> float:
    found = np.array(list(flags), dtype=np.float64)
    return float(found.mean()) if len(found) else float("nan")


def _median(values: Iterable[float]) -> float:
    found = np.array(list(values), dtype=np.float64)
    found = found[np.isfinite(found)]
    return float(np.median(found)) * ARCMIN_PER_DEG if len(found) else float("nan")


def _page(tables: Sequence[FigureData], seed: int, pool: int) -> tuple[Section, ...]:
    flights, changes, taxis, _pool = tables
    return (
        section(
            "Study: the learned installation",
            f"{AIRCRAFT} aircraft of {FLIGHTS} flights a family of docs/evidence/installation.md, seed {seed}, made of "
            f"{pool} one-way taxis through the whole heading estimator. Each flight is told by what the earlier ones "
            "of its serial taught; the first has its taxi alone. Coverage is the share of flights whose 95 % interval "
            "holds the truth.",
        ),
        section("The taxis", table(taxis)),
        section("By flight", table(flights)),
        section("By flights since another unit flew first (0: none did)", table(changes)),
    )
