"""A flight and results with plausible figures, made without readers or estimators: what the viewer's tests show."""

import numpy as np

from groundstation.base.angles import direction_of, wrap_180, wrap_360
from groundstation.base.clock import Clock
from groundstation.base.findings import Finding
from groundstation.base.geodesy import latitude_longitude_deg
from groundstation.base.records import Column
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.results.answer import by_analysis
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults, NotAssessable, Source
from groundstation.results.gates import Gate
from groundstation.systems.heading.answer import HeadingResult, OnboardComparison, Standstill, TaxiSegment
from groundstation.tables.table import Flight, Table
from tests.figure_arrays import figure
from tests.systems.inertial.example import forecast_result, inertial_result

START_NS = iso_to_utc_ns("2026-05-04T06:00:00Z")[0]
ERROR_DEG = 1.23
GNSS_GAP_S = (120.0, 123.0)
TAXI_S = (60.0, 180.0)


def motion(time_s: np.ndarray) -> dict[str, np.ndarray]:
    """A minute at standstill, two minutes of taxi with a turn, then a climb on a racetrack; noiseless."""
    moving = np.clip(time_s - TAXI_S[0], 0.0, None)
    taxi = np.clip(moving / 10.0, 0.0, 1.0) * 9.0
    flying = np.clip(time_s - TAXI_S[1], 0.0, None)
    speed = taxi + np.clip(2.5 * flying, 0.0, 71.0)
    turn = 90.0 * np.clip((time_s - 130.0) / 8.0, 0.0, 1.0) + 1.2 * np.clip(flying - 60.0, 0.0, None)
    heading = wrap_360(300.0 + turn)
    step = np.gradient(time_s)
    north = np.cumsum(speed * np.cos(np.deg2rad(heading)) * step)
    east = np.cumsum(speed * np.sin(np.deg2rad(heading)) * step)
    latitude, longitude = latitude_longitude_deg(north, east, 56.0, 38.0)
    return {
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "altitude_m": 180.0 + np.clip(5.0 * (flying - 28.0), 0.0, 1500.0),
        "speed_mps": speed,
        "heading_deg": heading,
    }


def table(topic: str, time_s: np.ndarray, **columns: np.ndarray | Column) -> Table:
    """A table from flight seconds and columns."""
    time_ns = START_NS + np.rint(time_s * 1e9).astype(np.int64)
    kept = {name: column if isinstance(column, Column) else Column(column) for name, column in columns.items()}
    return Table(topic, time_ns, kept, np.arange(len(time_ns)), Column(time_ns))


def ins_table(duration_s: float, rate_hz: float, rng: np.random.Generator, topic: str = "ins") -> Table:
    """An INS as a log has it: eighteen numbers, mode and validity."""
    time_s = np.arange(0.0, duration_s, 1.0 / rate_hz)
    truth = motion(time_s)
    heading_rad = np.deg2rad(truth["heading_deg"])
    noise = {name: rng.normal(0.0, 1.0, len(time_s)) for name in ("roll", "pitch", "sway", "x", "y", "z")}
    sway = np.convolve(noise["sway"], np.ones(50) / 50.0, mode="same")
    return table(
        topic,
        time_s,
        latitude_deg=truth["latitude_deg"] + 1e-9 * time_s,
        longitude_deg=truth["longitude_deg"],
        altitude_msl_m=truth["altitude_m"] + 0.2 * noise["z"],
        altitude_ellipsoid_m=truth["altitude_m"] + 14.0,
        velocity_north_mps=truth["speed_mps"] * np.cos(heading_rad),
        velocity_east_mps=truth["speed_mps"] * np.sin(heading_rad),
        velocity_down_mps=0.05 * noise["z"],
        roll_deg=0.3 * noise["roll"],
        pitch_deg=1.0 + 0.2 * noise["pitch"],
        true_heading_deg=wrap_360(truth["heading_deg"] + ERROR_DEG + sway),
        magnetic_heading_deg=wrap_360(truth["heading_deg"] - 11.0 + sway),
        **{f"rate_{axis}_dps": noise[axis] for axis in "xyz"},
        accel_x_mps2=0.1 * noise["x"],
        accel_y_mps2=0.1 * noise["y"],
        accel_z_mps2=-9.81 + 0.1 * noise["z"],
        mode=np.where(time_s < 0.1 * duration_s, "align", "nav"),
        valid=np.ones(len(time_s), dtype=bool),
    )


def gnss_table(duration_s: float, rng: np.random.Generator) -> Table:
    """A receiver at 10 Hz with one gap of three seconds on the taxi."""
    time_s = np.arange(0.0, duration_s, 0.1)
    time_s = time_s[(time_s <= GNSS_GAP_S[0]) | (time_s >= GNSS_GAP_S[1])]
    truth, count = motion(time_s), len(time_s)
    heading_rad = np.deg2rad(truth["heading_deg"])
    north = truth["speed_mps"] * np.cos(heading_rad) + rng.normal(0.0, 0.05, count)
    east = truth["speed_mps"] * np.sin(heading_rad) + rng.normal(0.0, 0.05, count)
    return table(
        "gnss",
        time_s,
        latitude_deg=truth["latitude_deg"],
        longitude_deg=truth["longitude_deg"],
        altitude_msl_m=truth["altitude_m"] + rng.normal(0.0, 2.0, count),
        velocity_north_mps=north,
        velocity_east_mps=east,
        track_deg=direction_of(north, east),
        ground_speed_mps=np.hypot(north, east),
        gdop=1.6 + 0.1 * np.sin(time_s / 40.0),
        hdop=0.9 + 0.05 * np.sin(time_s / 40.0),
        satellites_used=np.where(time_s < 200.0, 11.0, 9.0),
        integrity_ok=np.ones(count, dtype=bool),
    )


def make_flight(duration_s: float = 400.0, rate_hz: float = 100.0, *, has_utc: bool = True, seed: int = 7) -> Flight:
    """The flight: INS, receiver, on-board figures, an event and a topic of the source's own."""
    rng = np.random.default_rng(seed)
    seconds = np.arange(0.0, duration_s, 1.0)
    tables = [
        ins_table(duration_s, rate_hz, rng),
        gnss_table(duration_s, rng),
        table("onboard", seconds, heading_error_deg=np.full(len(seconds), 1.2), cycles=seconds),
        table("event", np.array([58.0, 181.0]), name=np.array(["brakes off", "take-off"])),
        table("discrete", seconds, weight_on_wheels=seconds < 205.0),
        table("raw.engine", seconds, oil_temperature=60.0 + seconds / 10.0, n1=np.clip(seconds, 0.0, 95.0)),
    ]
    return Flight({one.topic: one for one in tables}, {"aircraft": "A12"}, START_NS, has_utc, "example.csv")


def heading_figures(flight: Flight) -> tuple[FigureData, ...]:
    """Figures of the heading estimator over the example's taxi, by the plain formulas of the paper."""
    gnss = flight["gnss"]
    time_s, speed = flight.time_s("gnss"), gnss.values("ground_speed_mps")
    heading = np.interp(time_s, flight.time_s("ins"), flight["ins"].values("true_heading_deg"))
    difference = wrap_180(heading - gnss.values("track_deg"))
    gate = np.where(speed > 6.0, "used", "too slow").astype("U16")
    gate[(time_s > 128.0) & (time_s < 140.0)] = "turning"
    gate[time_s > TAXI_S[1]] = "airborne"
    used = gate == "used"
    d = difference[used]
    count = np.arange(1, len(d) + 1)
    mean = np.cumsum(d) / count
    sigma = np.sqrt(np.maximum(np.cumsum(d * d) / count - mean**2, 1e-6))
    precision = 1.96 * sigma / np.sqrt(np.maximum(count - 1, 1))
    running = {
        "cycles": count,
        "mean_deg": mean,
        "sigma_deg": sigma,
        "precision_deg": precision,
        "quality_deg": np.abs(mean - ERROR_DEG),
        "honest_half_width_deg": 2.5 * precision,
    }
    edges = np.linspace(d.mean() - 3.5 * d.std(), d.mean() + 3.5 * d.std(), 36)
    centre = 0.5 * (edges[1:] + edges[:-1])
    steps = np.unique(np.linspace(40, len(d), 60).astype(int))
    growth = [np.histogram(d[:step], edges, density=True)[0] for step in steps]
    x = np.linspace(edges[0], edges[-1], 600)
    normal = np.exp(-0.5 * ((x - d.mean()) / d.std()) ** 2) / (d.std() * np.sqrt(2.0 * np.pi))
    change = np.concatenate([[0], np.flatnonzero(gate[1:] != gate[:-1]) + 1])
    still = time_s < TAXI_S[0]
    mean_speed = np.linspace(0.0, 0.02, 60)
    return (
        figure(
            "heading_samples",
            time_s=time_s,
            heading_deg=heading,
            track_deg=gnss.values("track_deg"),
            ground_speed_mps=speed,
            difference_deg=difference,
            residual_deg=difference - ERROR_DEG,
            segment=np.where(used, 1, 0),
            is_used=used,
            gate=gate,
            weight=used.astype(float),
        ),
        figure("heading_running", time_s=time_s[used], **running),
        figure("heading_distribution", bin_low_deg=edges[:-1], bin_high_deg=edges[1:], density_per_deg=growth[-1]),
        figure("heading_normal", difference_deg=x, density_per_deg=normal),
        figure(
            "heading_growth",
            step=np.repeat(np.arange(len(steps)), len(centre)),
            time_s=np.repeat(time_s[used][steps - 1], len(centre)),
            bin_center_deg=np.tile(centre, len(steps)),
            density_per_deg=np.concatenate(growth),
        ),
        figure(
            "standstill_velocity",
            time_s=time_s[still],
            velocity_north_mps=gnss.values("velocity_north_mps")[still],
            velocity_east_mps=gnss.values("velocity_east_mps")[still],
            is_in_interval=time_s[still] > 30.0,
        ),
        figure(
            "standstill_mean_speed",
            window_s=np.repeat([10.0, 30.0], len(mean_speed)),
            speed_of_mean_mps=np.tile(mean_speed, 2),
            density_per_mps=np.concatenate(
                [mean_speed / width**2 * np.exp(-0.5 * (mean_speed / width) ** 2) for width in (0.006, 0.0035)]
            ),
        ),
        figure("heading_lanes", start_s=time_s[change], end_s=time_s[[*change[1:], -1]], state=gate[change]),
    )


def pipeline_figures(flight: Flight) -> tuple[FigureData, ...]:
    """Figures of the pipeline: overview, phases, ledger, gaps and GNSS lanes."""
    end = flight.duration_s
    time_s = np.arange(0.0, end, 0.5)
    truth = motion(time_s)
    track = np.where((time_s > GNSS_GAP_S[0]) & (time_s < GNSS_GAP_S[1]), np.nan, truth["heading_deg"])
    topics = flight.topics()
    rows = np.array([len(flight[topic]) for topic in topics])
    count = len(topics)
    return (
        figure(
            "overview",
            time_s=time_s,
            latitude_deg=truth["latitude_deg"],
            longitude_deg=truth["longitude_deg"],
            altitude_m=truth["altitude_m"],
            ground_speed_mps=truth["speed_mps"],
            heading_deg=wrap_360(truth["heading_deg"] + ERROR_DEG),
            track_deg=track,
            roll_deg=20.0 * np.sin(time_s / 30.0),
            pitch_deg=np.where(time_s > 208.0, 8.0, 0.0),
            climb_mps=np.gradient(truth["altitude_m"], time_s),
            true_airspeed_mps=np.where(time_s > TAXI_S[1], truth["speed_mps"] + 4.0, np.nan),
        ),
        figure(
            "phases",
            start_s=np.array([0.0, 60.0, 180.0, 208.0]),
            end_s=np.array([60.0, 180.0, 208.0, end]),
            phase=np.array(["standstill", "taxi", "take-off run", "airborne"]),
        ),
        figure(
            "ledger",
            topic=np.array(topics),
            rows=rows,
            first_s=np.zeros(count),
            last_s=np.array([flight.time_s(topic)[-1] for topic in topics]),
            nominal_rate_hz=np.full(count, np.nan),
            actual_rate_hz=rows / end,
            coverage=np.full(count, 0.9971),
            gaps=np.array([int(topic == "gnss") for topic in topics]),
            longest_gap_s=np.array([3.0 if topic == "gnss" else 0.0 for topic in topics]),
            duplicates=np.zeros(count, dtype=int),
            backward_steps=np.zeros(count, dtype=int),
            stray_rows=np.zeros(count, dtype=int),
            dropped_rows=np.zeros(count, dtype=int),
            lost_by_counter=np.zeros(count, dtype=int),
            out_of_range=np.zeros(count, dtype=int),
            stuck=np.zeros(count, dtype=int),
        ),
        figure("gaps", topic=np.array(["gnss"]), start_s=np.array([GNSS_GAP_S[0]]), length_s=np.array([3.0])),
        figure(
            "gnss_lanes",
            start_s=np.array([0.0, GNSS_GAP_S[0], GNSS_GAP_S[1]]),
            end_s=np.array([GNSS_GAP_S[0], GNSS_GAP_S[1], end]),
            state=np.array(["good", "no GNSS", "good"]),
        ),
    )


def heading_result(figures: tuple[FigureData, ...] = ()) -> HeadingResult:
    """An accepted heading result of the example's taxi."""
    return HeadingResult(
        ins_topic="ins",
        gnss_topic="gnss",
        heading_source="true heading",
        verdict="accept",
        verdict_reason="every required gate passed",
        error_deg=ERROR_DEG,
        standard_error_deg=0.021,
        confidence95_deg=(1.189, 1.271),
        paper_error_deg=1.24,
        precision_deg=0.017,
        quality_deg=0.11,
        estimate_sd_deg=0.41,
        samples=980,
        taxi_seconds=98.0,
        drift_deg_per_h=0.4,
        drift_sigma_deg_per_h=1.1,
        correction_deg=-1.2,
        entry_step_deg=0.1,
        gates=(
            Gate("taxi_seconds", "taxi time", 98.0, 20.0, "s", "passed"),
            Gate("precision", "precision e", 0.017, 0.05, "deg", "passed"),
            Gate("quality", "quality of the running mean", 0.11, 0.3, "deg", "passed"),
            Gate("variance_ratio", "variance against its parts", 1.1, (0.5, 2.0), "", "passed"),
            Gate("gdop", "geometry factor", None, 2.0, "", "not_measured", False, "no GDOP in the log"),
        ),
        standstill=Standstill(
            30.0, 60.0, 300, 0.001, -0.002, 0.05, 0.05, 0.06, 0.0022, 0.0071, 0.0, "weight on wheels"
        ),
        segments=(
            TaxiSegment(66.5, 120.0, 536, 300.0, 9.0, 1.22, 0.03),
            TaxiSegment(140.0, 180.0, 400, 30.0, 9.0, 1.25, 0.03),
        ),
        parking_heading_deg=298.8,
        parking_sigma_deg=0.03,
        reference_residual_arcmin=1.4,
        onboard=OnboardComparison(1.2, 0.04, 0.12, 410.0, -1.2, "accepted", -0.03),
        figures=figures,
    )


def make_results(
    flight: Flight, *, with_heading: bool = True, flight_id: str = "20260504T060000Z_A12_7"
) -> FlightResults:
    """Results of the example, with or without a heading answer."""
    heading = heading_figures(flight) if with_heading else ()
    inertial, forecast = inertial_result(flight.duration_s), forecast_result(flight.duration_s)
    missing = () if with_heading else (NotAssessable("heading", "no GNSS velocity in the log"),)
    return FlightResults(
        flight_id=flight_id,
        source=Source("example.csv", "0" * 64, 123456, "flat-csv"),
        metadata={"aircraft": "A12"},
        start_utc_ns=START_NS if flight.has_utc else None,
        duration_s=flight.duration_s,
        status="ok",
        completeness=dict.fromkeys(flight.topics(), 1.0),
        clock=Clock(first_device_time="2026-05-04T06:00:00.000Z", is_absolute=True, start="utc"),
        findings=(
            Finding(
                "warn", "clock.backward_step", "the recorder's clock stepped back by 0.2 s", "gnss", "at 61.3 s", 1
            ),
            Finding("info", "reader.assumed_utc", "times without a zone are read as UTC"),
        ),
        not_assessable=missing,
        answers=by_analysis(heading_result(heading) if with_heading else None, inertial, forecast),
        figures=(*pipeline_figures(flight), *heading, *inertial.figures, *forecast.figures),
    )
