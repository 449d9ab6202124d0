"""A flight's results with plausible figures, made without readers or estimators: what the report's tests show."""

from dataclasses import replace
from typing import Any

import numpy as np

from groundstation.base.angles import direction_of, wrap_180, wrap_360
from groundstation.base.clock import Clock
from groundstation.base.findings import Finding
from groundstation.base.geodesy import latitude_longitude_deg
from groundstation.results.answer import Answer, by_analysis
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults, NotAssessable, Source
from groundstation.results.gates import Gate
from groundstation.results.manifest import Host, Manifest
from groundstation.simulation.processes import damped_oscillation, gauss_markov
from groundstation.systems.heading.answer import (
    HeadingResult,
    OnboardComparison,
    RunwayCheck,
    Standstill,
    TaxiSegment,
)
from tests.figure_arrays import figure

ERROR_DEG = 1.04
MANIFEST = Manifest(
    groundstation="0.1.0",
    made_utc="2031-01-02T03:04:05Z",
    host=Host(platform="somewhere"),
    configuration={"exclude": [{"from": "+03:10", "to": "+03:15", "reason": "towed"}]},
)


def taxi_figures(seed: int = 3) -> tuple[FigureData, ...]:
    """Standstill of 60 s, taxi out of three straights with two turns and a gap, as the estimator saves them."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 260.0, 0.1)
    speed = 9.0 * np.clip((time - 62.0) / 12.0, 0.0, 1.0) * np.clip((255.0 - time) / 6.0, 0.0, 1.0)
    turns = 90.0 * np.clip((time - 130.0) / 9.0, 0.0, 1.0) + 88.0 * np.clip((time - 196.0) / 9.0, 0.0, 1.0)
    sway = damped_oscillation(rng, (1, len(time)), 0.1, 0.4, 0.4, 0.1)[0] * (speed > 0.5)
    noise = [rng.normal(0.0, 0.04, len(time)) + gauss_markov(rng, (1, len(time)), 0.1, 0.02, 4.0)[0] for _ in range(2)]
    course = np.deg2rad(302.0 + turns)
    north, east = speed * np.cos(course) + noise[0], speed * np.sin(course) + noise[1]
    heading = wrap_360(302.0 + turns + ERROR_DEG + sway)
    track = direction_of(north, east)
    difference = wrap_180(heading - track)
    rate = np.gradient(turns, 0.1)
    gate = np.where(speed > 6.0, "used", "too slow").astype("U20")
    gate[(np.abs(rate) > 1.0) & (speed > 6.0)] = "turning"
    gate[(time > 170.0) & (time < 173.0)] = "no heading"
    used = gate == "used"
    gone = gate == "no heading"
    for values in (heading, track, speed, difference):
        values[gone] = np.nan
    segment = np.where(used, 1 + (time > 139.0) + (time > 205.0), 0)
    d = difference[used]
    return (
        figure(
            "heading_samples",
            time_s=time,
            segment=segment,
            heading_deg=heading,
            track_deg=track,
            ground_speed_mps=speed,
            difference_deg=difference,
            residual_deg=difference - ERROR_DEG,
            is_used=used,
            gate=gate,
            weight=used.astype(float),
        ),
        *_answers(time[used], d),
        *_standstill(time[time < 60.0], north[time < 60.0], east[time < 60.0]),
        _lanes(time, gate),
    )


def _answers(time: Any, d: Any) -> tuple[FigureData, ...]:
    count = np.arange(1, len(d) + 1)
    mean = np.cumsum(d) / count
    sigma = np.sqrt(np.maximum(np.cumsum(d * d) / count - mean**2, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        e = 1.96 * sigma / np.sqrt(count - 1)
    second = np.cumsum(mean) / count
    quality = np.sqrt(np.maximum(np.cumsum(mean * mean) / count - second**2, 0.0))
    edges = np.linspace(d.mean() - 3.6 * d.std(), d.mean() + 3.6 * d.std(), 41)
    x = np.linspace(edges[0], edges[-1], 600)
    normal = np.exp(-0.5 * ((x - d.mean()) / d.std()) ** 2) / (d.std() * np.sqrt(2.0 * np.pi))
    return (
        figure(
            "heading_running",
            time_s=time,
            cycles=count,
            mean_deg=mean,
            sigma_deg=sigma,
            precision_deg=e,
            quality_deg=quality,
            honest_half_width_deg=0.05 + 2.0 * e,
        ),
        figure(
            "heading_distribution",
            bin_low_deg=edges[:-1],
            bin_high_deg=edges[1:],
            density_per_deg=np.histogram(d, edges, density=True)[0],
        ),
        figure("heading_normal", difference_deg=x, density_per_deg=normal),
    )


def _standstill(time: Any, north: Any, east: Any) -> tuple[FigureData, ...]:
    inside = (time >= 25.0) & (time < 55.0)
    speed = np.linspace(0.0, 0.03, 121)
    curves = [speed / scale**2 * np.exp(-0.5 * (speed / scale) ** 2) for scale in (0.0062, 0.0036)]
    return (
        figure(
            "standstill_velocity", time_s=time, velocity_north_mps=north, velocity_east_mps=east, is_in_interval=inside
        ),
        figure(
            "standstill_mean_speed",
            window_s=np.repeat([10.0, 30.0], len(speed)),
            speed_of_mean_mps=np.tile(speed, 2),
            density_per_mps=np.concatenate(curves),
        ),
    )


def _lanes(time: Any, gate: Any) -> FigureData:
    starts = np.flatnonzero(np.r_[True, gate[1:] != gate[:-1]])
    ends = np.r_[time[starts[1:]], time[-1]]
    return figure("heading_lanes", start_s=time[starts], end_s=ends, state=gate[starts])


def general_figures() -> tuple[FigureData, ...]:
    """Overview of a 50-minute racetrack flight, phases, ledger, gaps and GNSS lanes."""
    time = np.linspace(0.0, 3000.0, 3000)
    taxi = 9.0 * np.clip((time - 62.0) / 12.0, 0.0, 1.0) * (time < 255.0)
    speed = taxi + np.clip(2.4 * (time - 270.0), 0.0, 120.0) * np.clip((2850.0 - time) / 60.0, 0.0, 1.0)
    course = 302.0 + 90.0 * np.clip((time - 130.0) / 9.0, 0.0, 1.0) + 88.0 * np.clip((time - 196.0) / 9.0, 0.0, 1.0)
    course += 0.9 * np.clip(time - 500.0, 0.0, 200.0) + 0.9 * np.clip(time - 1500.0, 0.0, 200.0)
    course += 0.5 * np.clip(time - 2300.0, 0.0, 150.0)
    north = np.cumsum(speed * np.cos(np.deg2rad(course)))
    east = np.cumsum(speed * np.sin(np.deg2rad(course)))
    latitude, longitude = latitude_longitude_deg(north, east, 56.1234, 38.4321)
    altitude = 182.0 + np.clip(7.0 * (time - 330.0), 0.0, 3200.0) * np.clip((2760.0 - time) / 500.0, 0.0, 1.0)
    columns = {"latitude_deg": latitude, "longitude_deg": longitude, "altitude_m": altitude, "ground_speed_mps": speed}
    columns["climb_mps"] = np.gradient(altitude, time)
    for values in columns.values():
        values[(time > 1201.0) & (time < 1230.0)] = np.nan
    edges = [0.0, 62.0, 270.0, 312.0, 2780.0, 2840.0, 2900.0, 3000.0]
    phases = ["standstill", "taxi", "take-off run", "airborne", "landing roll", "taxi", "standstill"]
    topics = ["baro", "discrete", "gnss", "ins", "onboard", "raw.engine", "raw.fuel"]
    rates = np.array([10.0, 5.0, 10.0, 50.0, 1.0, 2.0, np.nan])
    count = len(topics)
    return (
        figure("overview", time_s=time, heading_deg=wrap_360(course), track_deg=wrap_360(course), **columns),
        figure("phases", start_s=edges[:-1], end_s=edges[1:], phase=phases),
        figure(
            "ledger",
            topic=topics,
            rows=[30000, 15000, 29690, 150000, 3000, 6000, 17],
            first_s=np.zeros(count),
            last_s=np.full(count, 3000.0),
            nominal_rate_hz=rates,
            actual_rate_hz=rates * 0.997,
            coverage=[1.0, 1.0, 0.9897, 1.0, 1.0, 0.9991, np.nan],
            gaps=[0, 0, 2, 0, 0, 1, 0],
            longest_gap_s=[0.1, 0.2, 28.1, 0.04, 1.0, 3.2, np.nan],
            duplicates=[0, 0, 14, 0, 0, 0, 0],
            backward_steps=[0, 0, 1, 0, 0, 0, 0],
            stray_rows=np.zeros(count, dtype=int),
            dropped_rows=np.zeros(count, dtype=int),
            lost_by_counter=np.zeros(count, dtype=int),
            out_of_range=np.zeros(count, dtype=int),
            stuck=np.zeros(count, dtype=int),
        ),
        figure(
            "gaps", topic=["gnss", "gnss", "raw.engine"], start_s=[170.0, 1201.5, 2001.0], length_s=[3.0, 28.1, 3.2]
        ),
        figure(
            "gnss_lanes",
            start_s=[0.0, 900.0, 960.0, 1201.0, 1230.0],
            end_s=[900.0, 960.0, 1201.0, 1230.0, 3000.0],
            state=["good", "gdop > 2", "good", "no GNSS", "good"],
        ),
        figure(
            "state_lanes",
            lane=["mode", "mode", "arming", "weight on wheels", "weight on wheels"],
            start_s=[0.0, 900.0, 0.0, 0.0, 960.0],
            end_s=[900.0, 3000.0, 3000.0, 960.0, 3000.0],
            state=["MANUAL", "AUTO", "armed", "on the ground", "in the air"],
        ),
    )


def gates() -> tuple[Gate, ...]:
    return (
        Gate("speed_of_mean", "Mean GNSS velocity at standstill", 0.0047, 0.01, "mps", "passed"),
        Gate("geometry", "Geometric factor (PDOP: no GDOP logged)", 1.62, 2.0, "", "passed"),
        Gate("integrity", "GNSS integrity flag", None, 0.9, "", "not_measured", False, "no integrity flag in the log"),
        Gate("taxi", "Straight taxi", 148.3, 20.0, "s", "passed", sense="at_least"),
        Gate("precision", "Precision e", 0.0221, 0.05, "deg", "passed"),
        Gate("quality", "Quality", 0.061, 0.3, "deg", "passed"),
        Gate("skewness", "Skewness", -0.12, (-0.5, 0.5), "", "passed", False, sense="between"),
        Gate(
            "kurtosis", "Excess kurtosis", 2.4, (-1.2, 2.0), "", "failed", False, "heavy tails: gusts near the hangar"
        ),
        Gate("drift", "Azimuth drift against its sigma", 1.1, 3.0, "", "passed"),
    )


def heading_result(**changes: Any) -> HeadingResult:
    """A heading result in full; ``changes`` replace fields."""
    segments = tuple(
        TaxiSegment(start, end, count, track, 8.9, ERROR_DEG + shift, sigma)
        for start, end, count, track, shift, sigma in (
            (70.0, 130.0, 600, 302.0, 0.03, 0.06),
            (139.0, 170.0, 310, 32.0, -0.05, 0.09),
            (173.0, 196.0, 230, 32.0, 0.02, 0.10),
            (205.0, 250.0, 450, 120.0, -0.01, 0.07),
        )
    )
    figures = taxi_figures()
    running = next(item for item in figures if item.name == "heading_running")
    last = {name: float(values[-1]) for name, values in running.columns.items()}
    whole = HeadingResult(
        ins_topic="ins",
        gnss_topic="gnss",
        heading_source="true heading",
        verdict="accept",
        verdict_reason="every required gate passed",
        error_deg=1.0379,
        standard_error_deg=0.031,
        confidence95_deg=(0.977, 1.099),
        paper_error_deg=last["mean_deg"],
        precision_deg=last["precision_deg"],
        quality_deg=last["quality_deg"],
        estimate_sd_deg=last["sigma_deg"],
        samples=int(last["cycles"]),
        taxi_seconds=0.1 * last["cycles"],
        drift_deg_per_h=0.8,
        drift_sigma_deg_per_h=0.7,
        correction_deg=-1.05,
        entry_step_deg=0.05,
        gates=gates(),
        standstill=Standstill(
            25.0,
            55.0,
            300,
            0.0031,
            -0.0035,
            0.0452,
            0.0447,
            0.0561,
            0.0047,
            0.0094,
            0.0033,
            "weight on wheels",
            0.04,
            0.02,
            4.1,
        ),
        segments=segments,
        directions=(replace(segments[0], samples=600), replace(segments[1], samples=540), segments[3]),
        lever_arm_m=4.12,
        lever_arm_sigma_m=0.35,
        lever_arm_origin="estimated",
        time_offset_s=0.042,
        time_offset_sigma_s=0.012,
        parking_ins_heading_deg=303.02,
        parking_heading_deg=301.98,
        parking_sigma_deg=0.04,
        reference_parking_heading_deg=302.04,
        reference_residual_arcmin=-3.6,
        runway=(RunwayCheck("12", 119.72, 120.71, 0.99, 0.05, -0.048),),
        onboard=OnboardComparison(1.02, 0.031, 0.08, 812.0, -1.0, "ready", -0.018),
        settings={
            "taxi_speed_min_mps": 6.0,
            "turn_rate_max_dps": 1.0,
            "turn_rate_kind": "slope",
            "geometry_max": 2.0,
            "taxi_min_s": 20.0,
            "precision_max_deg": 0.05,
            "quality_max_deg": 0.3,
            "excess_kurtosis_low": -1.2,
        },
        figures=figures,
    )
    return replace(whole, **changes)


def example(*answers: Answer | None, **changes: Any) -> FlightResults:
    """Results of the whole flight around its answers."""
    results = FlightResults(
        flight_id="20260504T060000Z_A12_17",
        source=Source("2026-05-04 A12 flight 17.csv", "9f" * 32, 48_211_902, "flat-csv"),
        metadata={"aircraft": "A12", "flight": "17", "start_utc": "2026-05-04T06:00:00Z", "crew": "Petrov, Ivanova"},
        start_utc_ns=1_777_874_400_000_000_000,
        duration_s=3000.0,
        status="ok",
        completeness={"gnss": 0.9897, "ins": 1.0},
        clock=Clock(first_device_time="12.000 s", nominal_period_s=0.02),
        findings=(
            Finding("info", "reader.derived", "GNSS velocity derived from track and ground speed", "gnss"),
            Finding(
                "warn", "clock.backward_step", "time stepped back by 0.2 s and was put right", "gnss", "row 8123", 1
            ),
            Finding("info", "integrity.gap", "gap of 28.1 s in flight", "gnss", "20:01", 1),
        ),
        not_assessable=(NotAssessable("magnetic", "no magnetometer in the log"),),
        answers=by_analysis(*answers),
        figures=(*general_figures(), *(figure for answer in answers if answer for figure in answer.figures)),
    )
    return replace(results, **changes)
