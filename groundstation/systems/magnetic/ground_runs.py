"""Deviation of an installed heading sensor from straight ground runs.

On the wheels the track is where the nose points. For logs without a three-axis magnetometer and without an INS that is
independent of it: a magnetic heading and GNSS velocity are enough. The runs are found as the heading analysis finds
straight taxi, slower and faster ones too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace

import numpy as np

from groundstation.base.angles import FloatArray, mean_heading, unwrap, wrap_180, wrap_360
from groundstation.base.errors import NotAssessableError
from groundstation.base.units import DEG_PER_RAD
from groundstation.base.words import counted
from groundstation.methods.moving_lines import fitted_lines, window_bounds
from groundstation.methods.taxi.samples import OnGround, TaxiSamples, take_samples
from groundstation.methods.taxi_error.interval import HeadingDifferences, Regressor, error_posterior
from groundstation.results.figures import FigureData
from groundstation.results.roles import Delays
from groundstation.systems.known import AircraftData
from groundstation.systems.magnetic.answer import DeclinationUsed
from groundstation.systems.magnetic.arrays import GroundRunCurve, GroundRunEpochs
from groundstation.systems.magnetic.compass_table import CENTRES_DEG
from groundstation.systems.magnetic.ground_answer import GroundDeviation, GroundRun, LeftOut
from groundstation.systems.magnetic.ground_epochs import (
    ANALYSIS,
    PAIR,
    GroundEpochs,
    count_left_out,
    declination_at,
    gated,
    logged_variation_deg,
    step_of,
)
from groundstation.systems.magnetic.ground_fit import (
    CurveFit,
    along_axis,
    coefficients_of,
    curve,
    directions_of,
    fit_curve,
    repeats_of,
    widest_gap_deg,
)
from groundstation.systems.magnetic.ground_settings import MagneticGroundSettings
from groundstation.tables.phases import Phases, flight_phases
from groundstation.tables.sources import choose_pair
from groundstation.tables.table import Flight

SMOOTHED_S = 5.0  # over which the heading is smoothed before its range is taken
MOST_EPOCHS = 1500  # of the noise model; more are thinned
MODEL_MPS = 8.0  # at which the priors of the noise model are those of a heading sensor too
FREE_DEG, PINNED_DEG = 30.0, 1e-3  # prior of an error of a run about their middle, and of that middle
STEPPED = ("magnetic_heading_deg", "track_deg")


def estimate_ground_deviation(
    flight: Flight,
    *,
    settings: MagneticGroundSettings | None = None,
    phases: Phases | None = None,
    on_ground: OnGround | None = None,
    aircraft: AircraftData | None = None,
    latencies: Delays | None = None,
    excluded_s: Sequence[tuple[float, float]] = (),
    ins_topic: str = "",
    gnss_topic: str = "",
) -> GroundDeviation:
    """Find the error of the magnetic heading on every straight ground run, and A to E.

    A to E are found as far as the runs show them.

    Parameters
    ----------
    flight : Flight
        Topics ``ins`` (magnetic heading) and ``gnss`` (velocities), a date and positions for the declination.
    settings : MagneticGroundSettings, optional
    phases : Phases, optional
        Name the runs. Default: found here.
    on_ground : callable, optional
        Ground contact at corrected times. Default: :func:`ground_mask`.
    aircraft, latencies : optional
        A known latency of GNSS behind the INS is taken out of the times.
    excluded_s : sequence of (start, end)
        Flight seconds that the user leaves out.
    ins_topic, gnss_topic : str
        Default: the first that have what is needed.

    Raises
    ------
    NotAssessableError
        With the reason: no magnetic heading, no velocity, ground contact not proven, no declination, no straight run.

    Notes ----- error = magnetic heading + declination - track. On its wheels an aircraft has no drift angle: the track
    is the true heading of the nose. Noise is that of the heading analysis, correlated over seconds (``interval.py``),
    each run with an error of its own. A to E are their posterior (``ground_fit.py``).

    What it ignores: the GNSS antenna's arm (a run is straight), a declination whose error differs between the places of
    one flight.
    """
    settings = settings or MagneticGroundSettings()
    phases = phases or flight_phases(flight)
    topics = choose_pair(flight, PAIR, ins_topic, gnss_topic)
    if phases.method.startswith("none"):
        raise NotAssessableError(ANALYSIS, f"ground contact is not proven: {phases.method.removeprefix('none: ')}")
    samples = gated(flight, topics, settings, on_ground, aircraft or AircraftData(), latencies, excluded_s)
    left_out = count_left_out(flight, topics, samples)
    chosen = np.flatnonzero(samples.is_used)
    if not len(chosen):
        raise NotAssessableError(ANALYSIS, _why_no_run(samples, left_out, settings))
    declination, used = declination_at(flight, topics, samples, chosen, settings)
    numbers = np.unique(samples.segment[chosen], return_inverse=True)[1]
    epochs = GroundEpochs(take_samples(samples, chosen), declination, numbers)
    runs = _runs(epochs, phases, settings)
    if not any(run.state == "used" for run in runs):
        raise NotAssessableError(ANALYSIS, _why_no_run(samples, left_out, settings, runs))
    steps = tuple(step_of(flight[topic], name) for topic, name in zip(topics, STEPPED, strict=True))
    runs = _with_errors(runs, epochs, used.sigma_deg, steps, settings)
    return _answer(flight, topics, epochs, runs, left_out, used, steps, settings)


def _why_no_run(
    samples: TaxiSamples,
    left_out: Sequence[LeftOut],
    settings: MagneticGroundSettings,
    rejected: Sequence[GroundRun] = (),
) -> str:
    limit = settings.speed_min_mps
    highest = float(np.max(samples.speed_mps[samples.on_ground], initial=0.0))
    if highest <= limit:
        return f"ground speed never above {limit:g} m/s where ground contact is proven: highest {highest:.1f} m/s"
    if rejected:
        told = "; ".join(f"at {run.start_s:.0f} s: {run.reason}" for run in rejected[:3])
        wanted = f"at least {settings.run_min_s:g} s and {settings.samples_min} epochs within"
        return f"no valid straight ground run: {told}; needed: {wanted} {settings.heading_change_max_deg:g} deg"
    told = ", ".join(f"{row.reason} {row.epochs}" for row in left_out)
    return f"no straight run on the ground above {limit:g} m/s; epochs: {told}"


def _runs(epochs: GroundEpochs, phases: Phases, settings: MagneticGroundSettings) -> tuple[GroundRun, ...]:
    """Every straight run, without its error yet; too short and curved ones with the reason."""
    rows = []
    for number in range(int(epochs.run.max()) + 1):
        mine = epochs.run == number
        part = take_samples(epochs.samples, mine)
        names, counts = np.unique(phases.at(part.time_s), return_counts=True)
        heading, start_s, end_s = part.heading_deg, float(part.time_s[0]), float(part.time_s[-1])
        changes = {"heading": _change_deg(part.time_s, heading), "track": _change_deg(part.time_s, part.track_deg)}
        reason = _why_rejected(len(part), end_s - start_s, changes, settings)
        rows.append(
            GroundRun(
                start_s=start_s,
                end_s=end_s,
                phase=str(names[np.argmax(counts)]),
                magnetic_heading_deg=mean_heading(heading),
                track_deg=mean_heading(part.track_deg),
                declination_deg=float(np.mean(epochs.declination_deg[mine])),
                error_deg=None,
                noise_sigma_deg=None,
                sigma_deg=None,
                samples=len(part),
                speed_mps=float(np.mean(part.speed_mps)),
                heading_change_deg=changes["heading"],
                state="rejected" if reason else "used",
                reason=reason,
            )
        )
    return tuple(rows)


def _change_deg(time_s: FloatArray, direction_deg: FloatArray) -> float:
    """Range of a direction smoothed by lines over 5 s."""
    low, high = window_bounds(time_s, time_s, SMOOTHED_S)
    _slope, smooth = fitted_lines(time_s, time_s, unwrap(direction_deg), low, high)
    known = smooth[np.isfinite(smooth)]
    return float(np.ptp(known)) if known.size else 0.0


def _why_rejected(
    samples: int, seconds: float, changes_deg: Mapping[str, float], settings: MagneticGroundSettings
) -> str:
    """Return why a run does not count; empty where it does.

    The track is looked at too: a heading that is stuck is no straight run.
    """
    if seconds < settings.run_min_s or samples < settings.samples_min:
        return f"short: {seconds:.1f} s, {counted(samples, 'epoch')}"
    name, change = max(changes_deg.items(), key=lambda item: item[1])
    return f"curved: {name} changed by {change:.0f} deg" if change > settings.heading_change_max_deg else ""


def _with_errors(
    runs: tuple[GroundRun, ...],
    epochs: GroundEpochs,
    declination_sigma_deg: float,
    steps_deg: Sequence[float | None],
    settings: MagneticGroundSettings,
) -> tuple[GroundRun, ...]:
    """The used runs with their errors: one noise model for all, an error of its own for each.

    The sensor's own noise is an angle whatever the speed, and most of what is seen: the model is given one speed. What
    lasts for a whole run is not averaged out: a GNSS velocity error over the speed, and rounding, step / sqrt(12).
    """
    used = [place for place, run in enumerate(runs) if run.state == "used"]
    mine = np.isin(epochs.run, used)
    mine &= np.cumsum(mine) % -(-int(mine.sum()) // MOST_EPOCHS) == 0
    part, numbers = take_samples(epochs.samples, mine), epochs.run[mine]
    middle = mean_heading(epochs.error_deg[mine])
    own = wrap_180(epochs.error_deg[mine] - middle)
    direction = part.track_deg.copy()
    for place in used:
        rows = numbers == place
        turned = part.heading_deg[rows] - mean_heading(part.heading_deg[rows])
        direction[rows] = wrap_360(runs[place].track_deg + wrap_180(turned))  # along the run, free of GNSS noise
    regressors = tuple(Regressor((numbers == place).astype(np.float64), 0.0, FREE_DEG) for place in used)
    posterior = error_posterior(
        HeadingDifferences(part.time_s, own, direction, np.full(len(part), MODEL_MPS), regressors, (0.0, PINNED_DEG)),
        draws=settings.posterior_draws,
        growth=2,
    )
    rounding = float(np.sqrt(sum(step**2 for step in steps_deg if step) / 12.0))
    told = list(runs)
    for column, place in enumerate(used):
        error, sigma = posterior.coefficient(column + 1)
        lasting = DEG_PER_RAD * settings.velocity_sigma_mps / told[place].speed_mps
        noise = float(np.sqrt(sigma**2 + rounding**2 + lasting**2))
        whole = float(np.sqrt(noise**2 + settings.slip_sigma_deg**2 + declination_sigma_deg**2))
        error = float(wrap_180(error + middle))
        told[place] = replace(told[place], error_deg=error, noise_sigma_deg=noise, sigma_deg=whole)
    return tuple(told)


def _answer(
    flight: Flight,
    topics: tuple[str, str],
    epochs: GroundEpochs,
    runs: tuple[GroundRun, ...],
    left_out: tuple[LeftOut, ...],
    declination: DeclinationUsed,
    steps_deg: Sequence[float | None],
    settings: MagneticGroundSettings,
) -> GroundDeviation:
    used = [run for run in runs if run.state == "used"]
    heading = np.array([run.magnetic_heading_deg for run in used])
    error = np.array([run.error_deg for run in used], dtype=np.float64)
    noise = np.array([run.noise_sigma_deg for run in used], dtype=np.float64)
    fit = fit_curve(heading, error, np.hypot(noise, settings.slip_sigma_deg), settings)
    coefficients = coefficients_of(fit, declination.sigma_deg, settings)
    result = GroundDeviation(
        ins_topic=topics[0],
        gnss_topic=topics[1],
        declination=declination,
        runs=runs,
        left_out=left_out,
        directions=len(directions_of(heading, settings.repeat_within_deg)),
        widest_gap_deg=widest_gap_deg(heading),
        place_sigma_deg=fit.place_sigma_deg,
        coefficients=coefficients,
        along=along_axis(fit, coefficients, settings),
        repeats=repeats_of(used, settings.slip_sigma_deg, settings.repeat_within_deg),
        logged_variation_deg=logged_variation_deg(flight, topics[0], epochs.samples.time_ns),
        heading_step_deg=steps_deg[0],
        track_step_deg=steps_deg[1],
        settings={name: value for name, value in asdict(settings).items() if value is not None},
        figures=_figures(epochs, runs, fit, declination.sigma_deg, settings),
    )
    return replace(result, remarks=_remarks(result, epochs.samples.interval_s, settings))


def _figures(
    epochs: GroundEpochs,
    runs: Sequence[GroundRun],
    fit: CurveFit,
    declination_sigma_deg: float,
    settings: MagneticGroundSettings,
) -> tuple[FigureData, ...]:
    samples = epochs.samples
    is_used = np.array([run.state == "used" for run in runs])[epochs.run]
    error, sigma = curve(fit, CENTRES_DEG, declination_sigma_deg, settings)
    return (
        GroundRunEpochs(
            time_s=samples.time_s,
            run=epochs.run + 1,
            is_used=is_used,
            magnetic_heading_deg=samples.heading_deg,
            track_deg=samples.track_deg,
            speed_mps=samples.speed_mps,
            heading_error_deg=epochs.error_deg,
        ),
        GroundRunCurve(magnetic_heading_deg=CENTRES_DEG, heading_error_deg=error, heading_error_sigma_deg=sigma),
    )


def _remarks(result: GroundDeviation, interval_s: float, settings: MagneticGroundSettings) -> tuple[str, ...]:
    """Return what must be told beside the figures, one line each."""
    declination = result.declination
    told = [
        "the level of all errors (A) cannot be separated from an error of the declination "
        f"({declination.sigma_deg:.2f} deg) or the mounting of the sensor",
        f"on its wheels the aircraft is assumed to point along the track, with {settings.slip_sigma_deg:g} deg a run "
        f"for slip; the {settings.settle_s:g} s after a turn are left out, to reduce the effect of a lagging heading",
    ]
    unseen: dict[str, list[str]] = {}
    for item in result.coefficients:
        if item.state == "not observable":
            unseen.setdefault(item.reason, []).append(item.letter)
    told += ["; ".join(f"{', '.join(letters)}: {reason}" for reason, letters in unseen.items())] if unseen else []
    steps = [
        f"{name} in steps of {step:g} deg"
        for name, step in (("heading", result.heading_step_deg), ("track", result.track_step_deg))
        if step is not None
    ]
    if interval_s > 0.0:
        told.append(", ".join([f"GNSS epochs every {interval_s:.2g} s", *steps]))
    if result.logged_variation_deg is not None:
        difference = float(wrap_180(result.logged_variation_deg - declination.value_deg))
        told.append(
            f"the log's own variation, {result.logged_variation_deg:+.2f} deg, and {declination.model}, "
            f"{declination.value_deg:+.2f} deg, differ by {difference:+.2f} deg; errors are against the latter"
        )
    wide = [row for row in result.repeats if row.spread_deg > 2.0 * row.expected_deg]
    told += [
        f"{row.runs} runs near {row.magnetic_heading_deg:.0f} deg spread by {row.spread_deg:.2f} deg; noise and "
        f"slip explain {row.expected_deg:.2f}: perhaps iron in the ground or switched loads"
        for row in wide
    ]
    return tuple(told)
