"""All algorithms on one session, judged where truth is known: the cooperative answer."""

from collections.abc import Sequence
from dataclasses import asdict, replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.methods.intervals import nees_limits
from groundstation.systems.cooperative import figures
from groundstation.systems.cooperative.algorithms import run_algorithm
from groundstation.systems.cooperative.answer import AlgorithmRow, CooperativeResult, GeometryRow, LinkRow, VehicleRow
from groundstation.systems.cooperative.consistency import TrackJudgement, judge
from groundstation.systems.cooperative.events import Prepared, prepare, require_vehicles
from groundstation.systems.cooperative.expected_honesty import HonestyCheck, check_pairwise, refusals, with_checks
from groundstation.systems.cooperative.geometry import Geometry, Truth, bound_of, geometry_of
from groundstation.systems.cooperative.loop_types import KINDS, PEER, POINT, USED
from groundstation.systems.cooperative.settings import ALGORITHMS, CooperativeSettings
from groundstation.systems.cooperative.stations.rows import station_findings, with_stations_judged
from groundstation.systems.cooperative.tracks import AlgorithmRun, VehicleTrack
from groundstation.tables.session import Session

SELDOM_GATED = 0.2
DEFAULT, KNOWN_ON_BOARD = "smoothed", "centralised"
MOST_MAPPED = 200  # states of all vehicles whose error map is judged


@dataclass(frozen=True)
class JudgedRun:
    """One algorithm with its judgement; an empty tuple where no truth is known."""

    run: AlgorithmRun
    judgements: tuple[TrackJudgement | None, ...]

    @property
    def known(self) -> list[tuple[int, TrackJudgement]]:
        """Vehicles with truth."""
        return [(index, one) for index, one in enumerate(self.judgements) if one is not None]


def estimate_session(
    session: Session,
    *,
    settings: CooperativeSettings,
    algorithms: Sequence[str] = tuple(ALGORITHMS),
    truth: Truth | None = None,
) -> tuple[CooperativeResult, tuple[Finding, ...]]:
    """Run the algorithms on one session.

    Parameters
    ----------
    session : Session
    settings : CooperativeSettings
    algorithms : sequence of str
        Names of ``settings.ALGORITHMS``; ``smoothed`` is the default answer, without it the last.
    truth : dict of vehicle to (time_s (m,), position_m (m, 3)), optional
        In the frame of the session; only judges.

    Returns
    -------
    CooperativeResult, tuple of Finding

    Raises
    ------
    NotAssessableError
        When no vehicle has dead reckoning.
    """
    prepared = prepare(session, settings)
    require_vehicles(prepared)
    prepared, stations = with_stations_judged(prepared, settings)
    truth = truth or {}
    settings, unmapped = _without_costly_map(prepared, settings)
    judged: list[JudgedRun] = []
    checks: dict[str, HonestyCheck] = {}
    for name in algorithms:
        if name == "pairwise" and judged:
            checks[name] = check_pairwise(prepared, settings, _reference_tracks(judged))
        if name not in checks or not checks[name].refused:
            judged.append(_judged(prepared, run_algorithm(prepared, settings, name), truth))
    default = _run_of(judged, DEFAULT)
    predicting = _run_of(judged, KNOWN_ON_BOARD).run
    bound = bound_of(prepared.session, settings, truth)
    smoothing_bound = bound
    if truth and DEFAULT in algorithms:
        smoothing_bound = bound_of(prepared.session, settings, truth, DEFAULT)
    geometry = geometry_of(prepared.session, settings, default.run)
    findings = [
        *prepared.findings,
        *(station_findings(stations) if stations else ()),
        *_findings(judged, settings),
        *refusals(checks),
        *unmapped,
    ]
    slots = len(np.unique(prepared.events.slot[np.isin(prepared.events.kind, (PEER, POINT))]))
    last = max(vehicle.last_s for vehicle in prepared.vehicles)
    answer = CooperativeResult(
        frame=session.frame,
        default_algorithm=default.run.algorithm,
        algorithms=with_checks(
            [
                _algorithm_row(prepared, one, smoothing_bound if one.run.algorithm == DEFAULT else bound, slots)
                for one in judged
            ],
            checks,
            algorithms,
        ),
        vehicles=tuple(row for one in judged for row in _vehicle_rows(prepared, one)),
        geometry=tuple(_geometry_row(one) for one in geometry),
        links=_link_rows(prepared, predicting),
        links_algorithm=predicting.algorithm,
        vehicle_names=prepared.session.names,
        point_names=tuple(point.name for point in session.points),
        duration_s=float(last - min(vehicle.first_s for vehicle in prepared.vehicles)),
        slots=slots,
        settings=_flat(asdict(settings)),
        stations=stations,
        figures=(
            figures.tracks_figure([(one.run, one.judgements) for one in judged]),
            figures.geometry_figure(geometry, bound),
            figures.map_figure([one.run for one in judged]),
            figures.links_figure(prepared, predicting, default.run),
            figures.traffic_figure([one.run for one in judged]),
            *([figures.stations_figure(stations)] if stations else []),
        ),
    )
    return answer, tuple(findings)


def _without_costly_map(prepared: Prepared, settings: CooperativeSettings) -> tuple[CooperativeSettings, list[Finding]]:
    """Leave out the error map of very many states.

    It judges a filter, and costs more than all of them.
    """
    states = sum(vehicle.size for vehicle in prepared.vehicles)
    if states <= MOST_MAPPED or settings.map_window_s == 0.0:
        return settings, []
    text = f"{states} states: the joint error map is left out, which is made for up to {MOST_MAPPED}"
    return replace(settings, map_window_s=0.0), [Finding("info", "cooperative.no_error_map", text, count=states)]


def _reference_tracks(judged: Sequence[JudgedRun]) -> tuple[VehicleTrack, ...]:
    """Return the tracks of the centralised filter, about which others are examined."""
    return next((one for one in judged if one.run.algorithm == KNOWN_ON_BOARD), judged[0]).run.tracks


def _run_of(judged: Sequence[JudgedRun], algorithm: str) -> JudgedRun:
    return next((one for one in judged if one.run.algorithm == algorithm), judged[-1])


@np.errstate(over="ignore", invalid="ignore")
def _judged(prepared: Prepared, run: AlgorithmRun, truth: Truth) -> JudgedRun:
    judgements = []
    for track, vehicle in zip(run.tracks, prepared.session.vehicles, strict=True):
        known = truth.get(track.name)
        judgements.append(None if known is None or not len(track.time_s) else judge(track, vehicle, *known))
    return JudgedRun(run, tuple(judgements))


def _algorithm_row(prepared: Prepared, one: JudgedRun, bound: AlgorithmRun, slots: int) -> AlgorithmRow:
    run = one.run
    ends = [float(track.two_sigma_r_m[-1]) for track in run.tracks if len(track.time_s)]
    whole = [_mean_square_root(track.two_sigma_r_m.tolist()) for track in run.tracks if len(track.time_s)]
    messages = sum(count for count, _ in run.messages.values())
    total = sum(size for _, size in run.messages.values())
    nees = low = high = ratio = rms = None
    diverges = None
    if one.known:
        rms = _mean_square_root([judgement.rms_m for _, judgement in one.known])
        nees = float(np.mean([np.nanmean(judgement.nees) for _, judgement in one.known]))
        low, high = nees_limits(2, len(one.known))
        diverges = any(judgement.diverges(run.tracks[index]) for index, judgement in one.known)
        least = [np.sqrt(np.mean((bound.tracks[index].two_sigma_r_m / 2.0) ** 2)) for index, _ in one.known]
        ratio = rms / _mean_square_root([float(value) for value in least])
    return AlgorithmRow(
        algorithm=run.algorithm,
        update=run.update,
        two_sigma_r_m=max(ends, default=float("nan")),
        rms_m=rms,
        nees=nees,
        nees_low=low,
        nees_high=high,
        bound_ratio=ratio,
        spectral_radius=float(run.map_radius.max()) if len(run.map_radius) else None,
        diverges=diverges,
        is_consistent=None if nees is None or low is None or high is None else low <= nees <= high,
        accepted=run.counts.get("used", 0),
        gated=run.counts.get("gated", 0),
        lost=run.counts.get("lost", 0),
        messages=messages,
        bytes_per_slot=total / slots if slots else 0.0,
        two_sigma_r_session_m=max(whole, default=None),
    )


def _mean_square_root(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _vehicle_rows(prepared: Prepared, one: JudgedRun) -> list[VehicleRow]:
    rows = []
    for track, vehicle, judgement in zip(one.run.tracks, prepared.vehicles, one.judgements, strict=True):
        if not len(track.time_s):
            continue
        state, sigma = track.state[-1], np.sqrt(np.diag(track.covariance[-1, :2, :2]))
        rows.append(
            VehicleRow(
                vehicle=track.name,
                algorithm=one.run.algorithm,
                epochs=len(track.time_s),
                sigma_north_m=float(sigma[0]),
                sigma_east_m=float(sigma[1]),
                two_sigma_r_m=float(track.two_sigma_r_m[-1]),
                rms_m=None if judgement is None else judgement.rms_m,
                end_error_m=None if judgement is None else _last(judgement.error_m),
                nees=None if judgement is None else float(np.nanmean(judgement.nees)),
                clock_m=float(state[vehicle.clock]) if vehicle.clock >= 0 else None,
                range_bias_m=float(state[vehicle.bias]) if vehicle.bias >= 0 else None,
            )
        )
    return rows


def _last(error_m: FloatArray) -> float | None:
    known = error_m[np.isfinite(error_m).all(axis=1)]
    return float(np.linalg.norm(known[-1])) if len(known) else None


def _geometry_row(one: Geometry) -> GeometryRow:
    def median(values: FloatArray) -> float | None:
        known = values[np.isfinite(values)]
        return float(np.median(known)) if len(known) else None

    return GeometryRow(
        vehicle=one.name,
        sources_median=median(one.sources) or 0.0,
        hdop_median=median(one.hdop),
        gdop_median=median(one.gdop),
        determinant_median=median(one.determinant) or 0.0,
        determinant_least=float(one.determinant.min()) if len(one.determinant) else 0.0,
        eigenvalue_least=float(one.eigenvalue.min()) if len(one.eigenvalue) else 0.0,
        gram_determinant_median=median(one.gram_determinant) or 0.0,
    )


def _link_rows(prepared: Prepared, run: AlgorithmRun) -> tuple[LinkRow, ...]:
    """Ranges and residuals of every direction of every link."""
    judged, events = run.judged, prepared.events
    links = np.stack([part[judged.event] for part in (events.receiver, events.source, events.kind)], axis=1)
    unique, link = np.unique(links, axis=0, return_inverse=True)
    named = [
        (prepared.vehicles[receiver].name, figures.source_name(prepared, kind, source), KINDS[kind])
        for receiver, source, kind in unique.tolist()
    ]
    rows = []
    for at in sorted(range(len(named)), key=lambda number: named[number]):
        (receiver, source, kind), mine = named[at], link.ravel() == at
        innovation, sigma, mark = judged.innovation[mine], judged.sigma[mine], judged.mark[mine]
        used = mark == USED
        has_any = bool(used.any())
        rows.append(
            LinkRow(
                receiver,
                source,
                kind,
                int(mine.sum()),
                int(used.sum()),
                int((~used).sum()),
                float(innovation[used].mean()) if has_any else None,
                float(np.sqrt(np.mean(innovation[used] ** 2))) if has_any else None,
                float(np.mean((innovation[used] / sigma[used]) ** 2)) if has_any else None,
            )
        )
    return tuple(rows)


def _findings(judged: Sequence[JudgedRun], settings: CooperativeSettings) -> list[Finding]:
    """Return findings about the runs themselves."""
    found = []
    for one in judged:
        name, counts = one.run.algorithm, one.run.counts
        used, gated = counts.get("used", 0), counts.get("gated", 0)
        if gated:
            severity = "warn" if gated > SELDOM_GATED * (used + gated) else "info"
            text = f"{name}: {gated} of {used + gated} measurements rejected at {settings.gate_sigma:g} sigma"
            found.append(Finding(severity, "cooperative.gated", text, count=gated))  # type: ignore[arg-type]
        if counts.get("clock_leaps", 0):
            text = f"{name}: a clock leap of a vehicle was assumed {counts['clock_leaps']} times"
            found.append(Finding("warn", "cooperative.clock_reset", text, count=counts["clock_leaps"]))
        if counts.get("unsettled", 0):
            text = f"{name}: the last of {settings.smoother.most_passes} passes still moved the answer"
            found.append(Finding("warn", "cooperative.not_settled", text))
        if counts.get("reopened", 0):
            count = counts["reopened"]
            text = f"{name}: a vehicle was not where it was estimated {count} times; its position was searched again"
            found.append(Finding("warn", "cooperative.reopened", text, count=count))
    return found


def _flat(table: dict[str, object], prefix: str = "") -> dict[str, float | str | bool]:
    out: dict[str, float | str | bool] = {}
    for name, value in table.items():
        if isinstance(value, dict):
            out |= _flat(value, f"{prefix}{name}.")
        elif isinstance(value, float | int | str):
            out[f"{prefix}{name}"] = value
    return out
