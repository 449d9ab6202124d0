"""Answers of made tracks in every state, and results that hold one, as pages and recordings show them."""

from dataclasses import replace
from typing import Any

import numpy as np

from groundstation.base.angles import wrap_360
from groundstation.results.answer import by_analysis
from groundstation.results.flight import FlightResults
from groundstation.results.gates import judged_gate
from groundstation.systems.trajectory.answer import BestTrajectory, NoiseRow, TrajectoryParameter, UnitMounting
from groundstation.systems.trajectory.arrays import (
    TrajectoryBiases,
    TrajectoryOutages,
    TrajectoryResiduals,
    TrajectoryTrack,
)
from groundstation.systems.trajectory.checks_answer import (
    AgainstOwnTrack,
    HeadingHypothesis,
    HeldOutRow,
    InnovationRow,
    OutageRow,
    RaisedSigma,
)
from groundstation.systems.trajectory.figures import accuracy_of, segments_of, separation_of, states_of, track_figure
from groundstation.systems.trajectory.onboard import compare_onboard
from groundstation.systems.trajectory.onboard_filters import filters_of
from groundstation.systems.trajectory.solution import TrackOfStates
from tests.report_example import example
from tests.systems.trajectory.made import onboard, track

NIS = InnovationRow("GNSS position", 1.12, 597), InnovationRow("GNSS velocity", 0.94, 597)
LENGTHS = (10.0, 30.0, 60.0, 120.0)


def accepted(of: TrackOfStates | None = None, *, heading_error_deg: float = 2.1, **changed: Any) -> BestTrajectory:
    """A drive whose on-board filter has a wrong heading from two thirds of it on."""
    states = track() if of is None else of
    time_s = np.arange(states.time_s[0] + 1.0, states.time_s[-1] - 1.0, 0.1)
    wrong = np.where(time_s > time_s[0] + 0.66 * (time_s[-1] - time_s[0]), heading_error_deg, 0.0)
    flight = onboard(states, heading_error_deg=wrong, arm_m=(1.2, -0.4), delay_s=0.04)
    compared = compare_onboard(states, flight, filters_of(flight)[0])
    rows, separation = separation_of(_forward(states), states)
    answer = BestTrajectory(
        state="accepted",
        reasons=(),
        imu="imu",
        gnss="gnss",
        is_integral=True,
        imu_rate_hz=100.0,
        vehicle="rolls",
        segments=segments_of(states),
        moving_s=0.8 * float(states.time_s[-1]),
        mounting=UnitMounting(
            "found", "x axis forward, z axis up, by level and direction of travel", 180.0, 0.0, 0.4, 0.3
        ),
        accuracy=accuracy_of(states),
        gates=(
            judged_gate((0.5, 2.0), "nis_position", "innovations of GNSS position", 1.12),
            judged_gate((None, 5.0), "heading_sigma", "sigma of the heading", 0.15, unit="deg"),
        ),
        raised=(
            RaisedSigma("position", 1.0),
            RaisedSigma("velocity", 1.0),
            RaisedSigma("tilt", 1.0),
            RaisedSigma("heading", 1.31, "heading minus own track scatters by 0.16 deg where 0.12 was expected"),
        ),
        noise=(
            NoiseRow("gyro noise", "deg/sqrt(s)", 0.0035, 0.0062),
            NoiseRow("accelerometer noise", "mg/sqrt(Hz)", 0.14, 0.31),
            NoiseRow("scale of white GNSS errors", "", 1.0, 0.25, is_at_bound=True),
            NoiseRow("slow GNSS error", "m", 1.0, 0.8),
        ),
        parameters=_parameters(),
        innovations=NIS,
        held_out=(
            HeldOutRow("horizontal position", "m", 60, 0.61, 0.66, 0.967),
            HeldOutRow("horizontal velocity", "m/s", 60, 0.041, 0.045, 0.95),
        ),
        own_track=AgainstOwnTrack(3120, 0.18, 0.10),
        outages=tuple(
            OutageRow(
                length,
                count,
                smoothed,
                forward,
                0.95,
                0.8,
                length * count,
                smoothed_worst_m=2.0 * smoothed,
                forward_end_worst_m=3.0 * forward,
            )
            for length, count, smoothed, forward in zip(
                LENGTHS, (20, 20, 18, 11), (0.4, 0.79, 1.25, 3.1), (1.1, 6.3, 20.4, 65.6), strict=True
            )
        ),
        hypotheses=(HeadingHypothesis(40.0, 312.0, 0.0), HeadingHypothesis(220.0, 131.0, 480.0)),
        onboard=None if compared is None else compared.errors,
        separation=rows,
        settings={},
        figures=(
            track_figure(states),
            states_of(states, "ellipsoid"),
            separation,
            *(() if compared is None else (compared.figure,)),
            _residuals(states),
            _biases(states),
            _outages(states),
        ),
    )
    return replace(answer, **changed)


def doubtful() -> BestTrajectory:
    """A solution whose innovations are larger than its covariance says."""
    reason = "innovations of GNSS velocity are 2.4 times what is expected, limit 2"
    innovations = (NIS[0], InnovationRow("GNSS velocity", 2.4, 597))
    return accepted(state="doubtful", reasons=(reason,), innovations=innovations)


def ambiguous() -> BestTrajectory:
    """A robot that hardly moved: two headings 155 deg apart."""
    states = track(120.0, sigma=4.0)
    answer = accepted(states)
    shown = next(one for one in answer.figures if isinstance(one, TrajectoryTrack))
    other = track_figure(states, np.asarray(wrap_360(states.heading_deg + 155.0)))
    hypotheses = (HeadingHypothesis(40.0, 312.0, 0.0), HeadingHypothesis(195.0, 107.0, 3.2))
    reason = "a heading of 107 deg at the end is only 3.2 log units below the best one of 312 deg, limit 10"
    figures = tuple(other if one is shown else one for one in answer.figures)
    return replace(answer, state="ambiguous", reasons=(reason,), hypotheses=hypotheses, figures=figures)


def without_filter() -> BestTrajectory:
    """A log without an on-board filter."""
    answer = accepted()
    return replace(answer, onboard=None, figures=tuple(one for one in answer.figures if "onboard" not in one.name))


def hover() -> BestTrajectory:
    """A multicopter that hovers, and whose filter is right."""
    states = track(300.0, hovers=True)
    mounting = UnitMounting("case", "")
    return accepted(
        states, heading_error_deg=0.0, vehicle="flies", is_integral=False, mounting=mounting, own_track=None
    )


def short() -> BestTrajectory:
    """One segment of a minute, without a replayed outage."""
    answer = accepted(track(60.0), heading_error_deg=0.0)
    bare = replace(answer, outages=(), held_out=(), noise=(), raised=(), separation=(), parameters=())
    return replace(bare, figures=tuple(one for one in answer.figures if not isinstance(one, TrajectoryOutages)))


def gapped() -> BestTrajectory:
    """Two segments with a gap of the unit between them."""
    return accepted(track(gap_s=(250.0, 290.0)))


def drawn() -> BestTrajectory:
    """Two minutes with every series that a figure may have."""
    states = track(120.0, gap_s=(50.0, 55.0))
    answer = accepted(states)
    shown = next(one for one in answer.figures if isinstance(one, TrajectoryTrack))
    other = track_figure(states, np.asarray(wrap_360(states.heading_deg + 155.0)))
    return replace(answer, figures=tuple(other if one is shown else one for one in answer.figures))


MADE = {
    "accepted": accepted,
    "doubtful": doubtful,
    "ambiguous": ambiguous,
    "without_filter": without_filter,
    "hover": hover,
    "short": short,
    "gapped": gapped,
}


def results_of(answer: BestTrajectory) -> FlightResults:
    """Results of a flight that has only this answer."""
    return replace(example(), answers=by_analysis(answer), figures=answer.figures, duration_s=answer.end_s)


def _forward(states: TrackOfStates) -> TrackOfStates:
    """A forward filter that settles within a minute and wanders a little."""
    fading = 3.0 * np.exp(-states.time_s / 20.0) + 0.3 * np.sin(0.05 * states.time_s)
    return replace(
        states,
        heading_deg=np.asarray(wrap_360(states.heading_deg + fading)),
        roll_deg=states.roll_deg + 0.1 * fading,
        latitude_deg=states.latitude_deg + 0.4 * fading / 111_300.0,
        velocity_mps=states.velocity_mps + 0.05 * fading[:, None],
    )


def _parameters() -> tuple[TrajectoryParameter, ...]:
    rows = [
        TrajectoryParameter(f"gyro bias {axis}", "gyro bias", "deg/s", value, 0.002, 1.0, True)
        for axis, value in zip("xyz", (0.021, -0.113, 0.054), strict=True)
    ]
    rows += [
        TrajectoryParameter(f"accelerometer bias {axis}", "accelerometer bias", "mg", value, 1.1, 50.0, True)
        for axis, value in zip("xyz", (3.4, -12.0, 7.7), strict=True)
    ]
    rows += [
        TrajectoryParameter("antenna forward of the unit", "lever arm", "m", 0.61, 0.12, 2.0, True),
        TrajectoryParameter("antenna right of the unit", "lever arm", "m", -0.05, 0.14, 2.0, True),
        TrajectoryParameter("antenna down of the unit", "lever arm", "m", 0.2, 1.9, 2.0, False),
        TrajectoryParameter("GNSS latency", "latency", "s", 0.112, 0.004, 0.3, True),
        TrajectoryParameter("wheel scale", "wheel", "%", 1.4, 0.1, 5.0, True),
    ]
    return tuple(rows)


def _residuals(states: TrackOfStates) -> TrajectoryResiduals:
    rng = np.random.default_rng(2)
    time_s = np.arange(states.time_s[0], states.time_s[-1], 1.0)
    held = (time_s // 10.0).astype(int) % 10 == 3
    used = ~held & (rng.random(len(time_s)) > 0.01)
    place, speed = rng.normal(0.0, 0.5, (len(time_s), 3)), rng.normal(0.0, 0.04, (len(time_s), 3))
    return TrajectoryResiduals(
        time_s=time_s,
        position_north_m=place[:, 0],
        position_east_m=place[:, 1],
        position_down_m=place[:, 2],
        velocity_north_mps=speed[:, 0],
        velocity_east_mps=speed[:, 1],
        velocity_down_mps=speed[:, 2],
        is_used=used,
        is_held_out=held,
    )


def _biases(states: TrackOfStates) -> TrajectoryBiases:
    time_s = np.arange(states.time_s[0], states.time_s[-1], 1.0)
    wander = 0.002 * np.sin(0.01 * time_s)
    sigma = 0.002 + 0.05 * np.exp(-time_s / 15.0)
    return TrajectoryBiases(
        time_s=time_s,
        gyro_x_dps=0.021 + wander,
        gyro_y_dps=-0.113 + wander,
        gyro_z_dps=0.054 - wander,
        gyro_x_sigma_dps=sigma,
        gyro_y_sigma_dps=sigma,
        gyro_z_sigma_dps=2.0 * sigma,
        accel_x_mg=3.4 + 100.0 * wander,
        accel_y_mg=-12.0 + 100.0 * wander,
        accel_z_mg=7.7 - 100.0 * wander,
        accel_x_sigma_mg=300.0 * sigma,
        accel_y_sigma_mg=300.0 * sigma,
        accel_z_sigma_mg=200.0 * sigma,
    )


def _outages(states: TrackOfStates) -> TrajectoryOutages:
    rng = np.random.default_rng(5)
    length_s = np.repeat(LENGTHS, 12)
    start_s = rng.uniform(states.time_s[0], states.time_s[-1], len(length_s))
    sigma = 0.12 * length_s**0.7
    error = sigma * np.hypot(*rng.normal(0.0, 0.55, (2, len(length_s))))
    return TrajectoryOutages(
        start_s=start_s,
        length_s=length_s,
        smoothed_error_m=error,
        smoothed_sigma_m=sigma,
        forward_end_error_m=0.01 * length_s**1.8 * rng.uniform(0.5, 2.0, len(length_s)),
        is_inside95=error < 1.73 * sigma,
    )
