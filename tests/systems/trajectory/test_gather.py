"""Input of the trajectory from made tables: increments, times on a line, gaps, fixes and their sigmas."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from groundstation.base.angles import FloatArray
from groundstation.base.errors import NotAssessableError
from groundstation.base.gaps import Pause
from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.systems.known import Interval, Known
from groundstation.systems.trajectory.gather import gather
from groundstation.systems.trajectory.gathered import Gathered
from groundstation.systems.trajectory.input_settings import InputSettings
from groundstation.systems.trajectory.retime import on_a_line
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight, Table

STEP_S, WHOLE_S = 0.01, 60.0
RATE_DPS, GRAVITY = 6.0, 9.8  # amplitude of the rate, specific force
ROUNDING_S = 2e-9  # of nanoseconds


def imu_times(whole_s: float = WHOLE_S, step_s: float = STEP_S) -> FloatArray:
    return np.arange(1, round(whole_s / step_s) + 1) * step_s


def rate_dps(time_s: FloatArray) -> FloatArray:
    return RATE_DPS * np.sin(time_s)


def angle_rad(time_s: FloatArray) -> FloatArray:
    """Integral of the rate from 0 on."""
    return np.asarray(np.deg2rad(RATE_DPS) * (1.0 - np.cos(time_s)))


def noise(count: int) -> FloatArray:
    return np.random.default_rng(7).normal(size=(count, 6)) * ([1e-3] * 3 + [1e-2] * 3)


def samples(time_s: FloatArray, stamp_s: FloatArray | None = None, topic: str = "imu", **columns: Any) -> Table:
    """Point samples of a unit that turns about its z axis."""
    wobble = noise(len(time_s))
    fields: dict[str, Any] = {
        "rate_x_dps": wobble[:, 0],
        "rate_y_dps": wobble[:, 1],
        "rate_z_dps": rate_dps(time_s) + wobble[:, 2] * 1e-6,
        "accel_x_mps2": wobble[:, 3],
        "accel_y_mps2": wobble[:, 4],
        "accel_z_mps2": -GRAVITY + wobble[:, 5],
        **columns,
    }
    return table(topic, time_s if stamp_s is None else stamp_s, fields)


def increments(time_s: FloatArray, stamp_s: FloatArray | None = None, topic: str = "imu", **columns: Any) -> Table:
    """Exact integrals of the same motion over the steps that end at ``time_s``."""
    wobble = noise(len(time_s)) * STEP_S
    fields: dict[str, Any] = {
        "delta_angle_x_rad": wobble[:, 0],
        "delta_angle_y_rad": wobble[:, 1],
        "delta_angle_z_rad": angle_rad(time_s) - angle_rad(time_s - STEP_S),
        "delta_velocity_x_mps": wobble[:, 3],
        "delta_velocity_y_mps": wobble[:, 4],
        "delta_velocity_z_mps": -GRAVITY * STEP_S + wobble[:, 5],
        "interval_s": np.full(len(time_s), STEP_S),
        **columns,
    }
    return table(topic, time_s if stamp_s is None else stamp_s, fields)


def fixes(topic: str = "gnss", step_s: float = 1.0, whole_s: float = WHOLE_S, **columns: Any) -> Table:
    """Fixes of a receiver that goes north at 10 m/s."""
    time_s = np.arange(0.0, whole_s, step_s) + 0.5
    count = len(time_s)
    fields: dict[str, Any] = {
        "latitude_deg": 55.0 + 1e-4 * time_s,
        "longitude_deg": np.full(count, 37.0),
        "altitude_ellipsoid_m": np.full(count, 150.0),
        "velocity_north_mps": np.full(count, 10.0),
        "velocity_east_mps": np.zeros(count),
        "velocity_down_mps": np.zeros(count),
        **columns,
    }
    return table(topic, time_s, {name: values for name, values in fields.items() if values is not None})


def table(topic: str, time_s: FloatArray, fields: Mapping[str, Any]) -> Table:
    """Rows in order of time, as a log's table has them; ``record_index`` keeps the order of the log."""
    time_ns = np.round(time_s * NS_PER_S).astype(np.int64)
    columns = {name: _column(values) for name, values in fields.items() if values is not None}
    made = Table(topic, time_ns, columns, np.arange(len(time_ns)), Column(time_ns))
    return made.take(np.argsort(time_ns, kind="stable"))


def _column(values: Any) -> Column:
    values = np.asarray(values)
    return Column(values, np.isfinite(values) if values.dtype.kind == "f" else None)


def gathered(*tables: Table, known: Known | None = None, **settings: Any) -> Gathered:
    flight = Flight({one.topic: one for one in tables}, start_ns=0)
    return gather(flight, known or Known(Phases((), "none")), InputSettings(**settings))


def codes(found: Gathered) -> dict[str, int]:
    return {note.code: note.count for note in found.notes}


def refused(*tables: Table, **settings: Any) -> str:
    with pytest.raises(NotAssessableError) as caught:
        gathered(*tables, **settings)
    return str(caught.value)


# ---- inertial unit


def test_increments_come_as_they_are() -> None:
    time_s = imu_times()
    found = gathered(increments(time_s), fixes())
    assert found.imu.is_integral and found.topics == ("imu", "gnss")
    assert np.allclose(found.imu.time_s, time_s, atol=ROUNDING_S, rtol=0.0)
    assert found.imu.delta_angle_rad[:, 2].sum() == pytest.approx(angle_rad(time_s[-1:])[0], abs=1e-12)
    assert found.imu.delta_velocity_mps[:, 2].mean() == pytest.approx(-GRAVITY * STEP_S, abs=1e-5)
    assert found.imu_facts.rate_hz == pytest.approx(100.0) and found.imu_facts.gaps == 0
    assert not {"retimed", "gaps", "bridged", "point_samples"} & codes(found).keys()


def test_samples_become_increments_by_the_trapezoid() -> None:
    time_s = imu_times()
    found = gathered(samples(time_s), fixes())
    assert not found.imu.is_integral and "point_samples" in codes(found)
    turned = np.cumsum(found.imu.delta_angle_rad[1:, 2])
    expected = angle_rad(found.imu.time_s[1:]) - angle_rad(found.imu.time_s[:1])
    largest = np.deg2rad(RATE_DPS) * STEP_S**2 / 12.0 * WHOLE_S  # error of the trapezoid
    assert np.abs(turned - expected).max() < largest
    assert np.allclose(found.imu.interval_s[1:], STEP_S, atol=ROUNDING_S)


def test_velocity_over_another_interval_is_brought_to_that_of_the_angle() -> None:
    time_s = imu_times()
    twice = np.full(len(time_s), 2.0 * STEP_S)
    down = -GRAVITY * 2.0 * STEP_S + 1e-4 * noise(len(time_s))[:, 5]
    found = gathered(increments(time_s, velocity_interval_s=twice, delta_velocity_z_mps=down), fixes())
    assert codes(found)["other_interval"] == len(time_s)
    assert np.allclose(found.imu.delta_velocity_mps[:, 2], -GRAVITY * STEP_S, atol=1e-5)


def test_increments_are_taken_before_faster_samples_and_a_named_unit_before_both() -> None:
    fast = imu_times(step_s=0.005)
    tables = (increments(imu_times(), topic="imu.2"), samples(fast, topic="imu.1"), fixes())
    found = gathered(*tables)
    assert found.imu_facts.topic == "imu.2" and codes(found)["several_units"] == 1
    assert gathered(*tables, imu_topic="imu.1").imu_facts.rate_hz == pytest.approx(200.0)
    assert "no topic imu.9" in refused(*tables, imu_topic="imu.9")


def test_a_unit_of_a_part_of_the_flight_does_not_come_first() -> None:
    found = gathered(increments(imu_times(10.0), topic="imu.1"), samples(imu_times(), topic="imu.2"), fixes())
    assert found.imu_facts.topic == "imu.2"


def test_the_fuller_of_equal_units_is_taken() -> None:
    time_s = imu_times()
    keep = np.arange(len(time_s)) % 50 > 0
    found = gathered(samples(time_s, topic="imu.1").take(keep), samples(time_s, topic="imu.2"), fixes())
    assert found.imu_facts.topic == "imu.2"


def test_jitter_of_3_ms_is_taken_off_the_stamps() -> None:
    time_s = imu_times()
    stamp_s = time_s + np.random.default_rng(1).uniform(-0.003, 0.003, len(time_s)) + 0.004
    for made in (samples(time_s, stamp_s), increments(time_s, stamp_s)):
        found = gathered(made, fixes())
        assert (np.diff(found.imu.time_s) > 0.0).all()
        error_s = found.imu.time_s - 0.004 - time_s
        assert np.abs(error_s).max() < 0.0005  # six sigma of the middle of a thousand stamps
        assert found.imu_facts.jitter_s == pytest.approx(0.006 / np.sqrt(12.0), rel=0.05)
        assert codes(found)["retimed"] == len(time_s)


def test_jitter_beyond_a_step_with_lost_samples() -> None:
    rng = np.random.default_rng(2)
    time_s = imu_times(step_s=0.004)
    keep = np.ones(len(time_s), dtype=bool)
    keep[[4000, 4001, 4002, 9000, 9001, 9002, 9003, 9004]] = False
    stamp_s = time_s + rng.normal(0.0, 0.003, len(time_s))
    found = gathered(samples(time_s, stamp_s), fixes())
    assert (np.diff(found.imu.time_s) > 0.0).all()
    lost = on_a_line(stamp_s[keep])
    assert lost.lost == 8 and lost.is_moved
    error_s = lost.time_s - time_s[keep]
    near = np.zeros(len(error_s), dtype=bool)  # the place of a loss is known to some samples only
    near[3950:4050], near[8940:9050] = True, True
    assert np.abs(error_s[~near]).max() < 0.0008


def test_increments_stay_increments_under_jitter_beyond_a_step() -> None:
    time_s = imu_times()
    stamp_s = time_s + np.random.default_rng(8).normal(0.0, 0.012, len(time_s))
    found = gathered(increments(time_s, stamp_s), fixes())
    assert found.imu.is_integral and found.imu.interval_s == pytest.approx(STEP_S)


def test_batches_that_share_a_stamp_are_spread() -> None:
    time_s = imu_times()
    stamp_s = np.ceil(time_s * 10.0 - 1e-9) / 10.0  # ten samples, stamped when the last one is there
    found = gathered(samples(time_s, stamp_s), fixes())
    step_s = np.diff(found.imu.time_s)
    assert step_s == pytest.approx(STEP_S, rel=1e-3)
    late_s = found.imu.time_s - time_s
    assert late_s.std() < 0.001 and 0.03 < late_s.mean() < 0.06


def test_stamps_of_few_digits_are_put_on_a_line() -> None:
    time_s = imu_times(step_s=1.0 / 152.0)
    found = gathered(samples(time_s, np.floor(time_s * 1000.0) / 1000.0), fixes())
    assert np.diff(found.imu.time_s) == pytest.approx(1.0 / 152.0, rel=1e-3)


def test_a_clock_that_drifts_is_followed() -> None:
    time_s = imu_times()
    stamp_s = time_s * (1.0 + 200e-6) + np.random.default_rng(3).normal(0.0, 0.001, len(time_s))
    found = gathered(increments(time_s, stamp_s), fixes())
    assert np.abs(found.imu.time_s - time_s * (1.0 + 200e-6)).max() < 0.0005
    assert found.imu.interval_s == pytest.approx(STEP_S)  # as the unit says


def test_uneven_samples_keep_their_stamps() -> None:
    time_s = np.cumsum(np.random.default_rng(4).uniform(0.004, 0.016, 6000))
    found = gathered(samples(time_s), fixes())
    assert np.allclose(found.imu.time_s, time_s, atol=ROUNDING_S) and codes(found)["uneven"] == 6000


def test_a_new_rate_has_a_line_of_its_own() -> None:
    slow, fast = imu_times(30.0, 0.02), 30.0 + imu_times(30.0, 0.005)
    time_s = np.concatenate((slow, fast))
    stamp_s = time_s + np.random.default_rng(5).uniform(-0.001, 0.001, len(time_s))
    found = gathered(samples(time_s, stamp_s), fixes())
    assert np.abs(found.imu.time_s - time_s).max() < 0.005
    assert np.abs(found.imu.time_s - time_s)[np.abs(time_s - 30.0) > 1.0].max() < 0.0005


def test_one_lost_increment_is_bridged_at_the_mean_rate() -> None:
    time_s = imu_times()
    keep = np.ones(len(time_s), dtype=bool)
    keep[2000:5000:20] = False
    found = gathered(increments(time_s).take(keep), fixes())
    assert found.imu.interval_s.sum() == pytest.approx(WHOLE_S) and found.imu_facts.gaps == 0
    assert found.imu_facts.bridged_s == pytest.approx(150 * STEP_S) and "bridged" in codes(found)
    total = np.deg2rad(RATE_DPS) * (1.0 - np.cos(WHOLE_S))
    assert found.imu.delta_angle_rad[:, 2].sum() == pytest.approx(total, abs=150 * 1e-4 * STEP_S)


def test_a_gap_stays_a_gap() -> None:
    time_s = imu_times()
    for length_s in (0.2, 3.0):
        keep = (time_s <= 20.0) | (time_s > 20.0 + length_s)
        for made in (increments(time_s), samples(time_s)):
            found = gathered(made.take(keep), fixes())
            assert found.imu.interval_s.max() == pytest.approx(STEP_S, rel=1e-3)
            assert (found.imu_facts.gaps, codes(found)["gaps"]) == (1, 1)
            assert found.imu_facts.longest_gap_s == pytest.approx(length_s, abs=2 * STEP_S)


def test_a_pause_of_the_log_while_disarmed_is_no_gap_of_the_unit() -> None:
    """A log with one pause of 21.2 s was told as "1 gap of imu, 21.2 s in all"."""
    time_s = imu_times()
    keep = (time_s <= 20.0) | (time_s > 41.2)
    pause = Pause(round(20.0 * NS_PER_S), round(41.2 * NS_PER_S))
    made = {one.topic: one for one in (increments(time_s).take(keep & ((time_s < 50.0) | (time_s > 53.0))), fixes())}

    def notes_of(*pauses: Pause) -> dict[str, str]:
        flight = Flight(made, start_ns=0, pauses=pauses)
        return {note.code: note.text for note in gather(flight, Known(Phases((), "none")), InputSettings()).notes}

    assert notes_of(pause)["pauses"] == "1 pause of the log while disarmed, 21.2 s in all"
    assert notes_of(pause)["gaps"].startswith("1 gap of imu, 3.0 s in all")
    assert "pauses" not in notes_of() and notes_of()["gaps"].startswith("2 gaps of imu, 24.2 s in all")
    early = Pause(round(30.0 * NS_PER_S), pause.end_ns)  # the log stopped 10 s before the pause
    assert notes_of(early)["gaps"].startswith("2 gaps of imu, 13.0 s in all")


def test_increments_of_a_part_of_the_time_are_samples() -> None:
    time_s = imu_times()
    found = gathered(increments(time_s).take(slice(0, None, 4)), fixes())
    assert not found.imu.is_integral and "point_samples" in codes(found)
    assert found.imu.interval_s.sum() == pytest.approx(WHOLE_S, abs=0.1)


def test_increments_that_overlap_are_refused() -> None:
    time_s = imu_times()
    assert "cover 200 % of the time" in refused(increments(time_s, interval_s=np.full(len(time_s), 0.02)), fixes())


def test_samples_logged_twice_and_backward_stamps() -> None:
    time_s = imu_times()
    twice = np.sort(np.concatenate((np.arange(len(time_s)), np.arange(100, 200))))
    made = samples(time_s).take(twice)
    made = replace(made, record_index=np.arange(len(made)))
    assert codes(gathered(made, fixes()))["duplicates"] == 100
    stamp_s = time_s.copy()
    stamp_s[[3000, 3001]] = stamp_s[[3001, 3000]]
    found = gathered(samples(time_s, stamp_s), fixes())
    assert np.abs(found.imu.time_s - time_s).max() < 0.001 and "1 go back" in _text(found, "retimed")


def test_held_samples_are_dropped() -> None:
    time_s = imu_times()
    held = np.repeat(np.arange(0, len(time_s), 2), 2)
    made = samples(time_s)
    columns = {name: column.take(held) for name, column in made.columns.items()}
    found = gathered(replace(made, columns=columns), fixes())
    assert codes(found)["duplicates"] == len(time_s) // 2
    assert found.imu_facts.rate_hz == pytest.approx(50.0, rel=1e-3)


def test_repeats_among_samples_and_what_is_bridged_for_them_are_one_count_in_one_sentence() -> None:
    time_s = imu_times()
    rows = np.arange(len(time_s))
    rows[rows % 20 == 10] -= 1
    made = samples(time_s)
    columns = {name: column.take(rows) for name, column in made.columns.items()}
    found = gathered(replace(made, columns=columns), fixes())
    count = int(np.count_nonzero(rows != np.arange(len(time_s))))
    bridged_s = count * float(np.median(np.diff(time_s)))
    assert codes(found)["duplicates"] == count and "bridged" not in codes(found)
    assert _text(found, "duplicates").endswith(
        f"repeat the one before: left out, the {bridged_s:.1f} s that they stood for bridged"
    )
    assert found.imu_facts.bridged_s == pytest.approx(bridged_s, rel=1e-3)


def test_samples_that_are_missing_are_told_apart_from_repeats() -> None:
    time_s = imu_times()
    whole = np.arange(len(time_s))
    missing = samples(time_s).take(whole[whole % 20 != 10])
    assert "are missing in steps below 0.1 s" in _text(gathered(missing, fixes()), "bridged")


def test_a_stretch_of_the_log_written_again_does_not_go_back_in_time() -> None:
    time_s = imu_times()
    again = np.concatenate((np.arange(4000), np.arange(2000, 6000)))
    found = gathered(samples(time_s[again]), fixes())
    assert (np.diff(found.imu.time_s) > 0.0).all()
    assert found.imu.interval_s.sum() == pytest.approx(WHOLE_S, abs=0.05)


def test_nan_and_absent_samples_are_gaps() -> None:
    time_s = imu_times()
    rate = rate_dps(time_s)
    rate[1000:1100] = np.nan
    accel = np.full(len(time_s), -GRAVITY) + noise(len(time_s))[:, 5]
    accel[3000:3050] = np.inf
    found = gathered(samples(time_s, rate_z_dps=rate, accel_z_mps2=accel), fixes())
    assert codes(found)["absent_samples"] == 150 and found.imu_facts.gaps == 2
    assert np.isfinite(found.imu.delta_angle_rad).all() and np.isfinite(found.imu.delta_velocity_mps).all()


def test_parts_of_a_sample_in_two_rows_are_one() -> None:
    time_s = imu_times()
    whole = samples(time_s)
    even = np.arange(2 * len(time_s)) % 2 == 0
    columns = {}
    for name, column in whole.columns.items():
        columns[name] = Column(np.repeat(column.values, 2), even if name.startswith("rate") else ~even)
    made = Table("imu", np.repeat(whole.time_ns, 2), columns, np.arange(len(even)), Column(np.repeat(whole.time_ns, 2)))
    assert len(gathered(made, fixes()).imu) == len(time_s)


def test_sensors_sampled_apart_are_brought_to_one_time() -> None:
    fast, slow = imu_times(), imu_times(step_s=0.025) - 0.0013
    whole, force = samples(fast), samples(slow)
    only_rates = {name: column for name, column in whole.columns.items() if name.startswith("rate")}
    only_force = {name: column for name, column in force.columns.items() if name.startswith("accel")}
    only_force["accel_x_mps2"] = Column(0.01 * slow)  # a ramp
    time_s = np.concatenate((fast, slow))
    order = np.argsort(time_s, kind="stable")
    columns = {}
    for parts, mask in (
        (only_rates, np.arange(len(time_s)) < len(fast)),
        (only_force, np.arange(len(time_s)) >= len(fast)),
    ):
        for name, column in parts.items():
            values = np.zeros(len(time_s))
            values[mask] = column.values
            columns[name] = Column(values[order], mask[order])
    time_ns = np.round(time_s[order] * NS_PER_S).astype(np.int64)
    found = gathered(Table("imu", time_ns, columns, np.arange(len(time_ns)), Column(time_ns)), fixes())
    assert "sampled_apart" in codes(found) and found.imu_facts.rate_hz == pytest.approx(100.0)
    ramp = found.imu.delta_velocity_mps[1:, 0] / found.imu.interval_s[1:]
    assert np.abs(ramp - 0.01 * (found.imu.time_s[1:] - 0.5 * STEP_S)).max() < 1e-6
    assert found.imu_facts.gaps == 0 and len(found.imu) > 5990


def test_a_stuck_axis_is_left_out_or_refused() -> None:
    time_s = imu_times()
    stuck = noise(len(time_s))[:, 0]
    stuck[2000:3000] = 0.25
    found = gathered(samples(time_s, rate_x_dps=stuck), fixes())
    assert codes(found)["stuck_axis"] == 1000 and "gyro x of imu keeps one value from 0:20" in _text(
        found, "stuck_axis"
    )
    assert found.imu_facts.longest_gap_s == pytest.approx(10.0, abs=0.05)
    assert "gyro x of imu keeps one value" in refused(samples(time_s, rate_x_dps=np.full(len(time_s), 0.25)), fixes())


def test_an_axis_stuck_at_rest_is_told_by_the_other_two() -> None:
    """All are quiet. Of a coarse unit, whose noise is below its steps, no axis is stuck that keeps its value."""
    time_s = imu_times()
    quiet = noise(len(time_s))
    stuck = quiet.copy()
    stuck[4000:4800, 2] = stuck[4000, 2]
    rests = (np.arange(len(time_s)) >= 4000) & (np.arange(len(time_s)) < 4800)
    coarse = (
        np.round((quiet * np.where(rests, 1.0, 20.0)[:, None] + [0.005, 0.005, 0.0, 0.0, 0.0, 0.0]) * 100.0) / 100.0
    )
    assert np.ptp(coarse[rests, 2]) == 0.0 and np.ptp(coarse[rests, 0]) > 0.0
    names = ("rate_x_dps", "rate_y_dps", "rate_z_dps")

    def unit(rates: FloatArray) -> Table:
        return samples(time_s, **dict(zip(names, rates[:, :3].T, strict=True)))

    found = gathered(unit(stuck), fixes())
    assert codes(found)["stuck_axis"] == 800 and "gyro z of imu keeps one value from 0:40" in _text(found, "stuck_axis")
    assert "stuck_axis" not in codes(gathered(unit(coarse), fixes()))


@pytest.mark.parametrize("axis", range(6))
def test_a_stuck_axis_of_increments_over_uneven_intervals_is_found(axis: int) -> None:
    """A quiet unit whose intervals vary: the increments do too, and are in single precision."""
    time_s = imu_times()
    interval_s = (STEP_S * (1.0 + 0.01 * np.sin(7.0 * time_s))).astype(np.float32).astype(np.float64)
    name = [*(f"delta_angle_{one}_rad" for one in "xyz"), *(f"delta_velocity_{one}_mps" for one in "xyz")][axis]
    sound = increments(time_s, interval_s=interval_s)
    values = sound.values(name).copy()
    values[1000:4000] = (0.3 * interval_s[1000:4000]).astype(np.float32)
    found = gathered(increments(time_s, interval_s=interval_s, **{name: values}), fixes())
    assert codes(found)["stuck_axis"] == pytest.approx(3000, abs=2)
    assert "stuck_axis" not in codes(gathered(sound, fixes()))


def test_clipping_and_saturation_are_told_with_their_place() -> None:
    time_s = imu_times()
    clips = np.zeros(len(time_s))
    clips[1500:1510] = 1.0
    rate = rate_dps(time_s)
    rate[4000:4020] = 250.0
    found = gathered(samples(time_s, gyro_clipping=clips, rate_z_dps=rate), fixes())
    assert (found.imu_facts.clipped, found.imu_facts.saturated) == (10, 20)
    assert "first at 0:15" in _text(found, "clipped") and "gyro z stays at 250 deg/s" in _text(found, "saturated")


def test_no_unit_and_no_receiver_are_refused() -> None:
    time_s = imu_times()
    assert "no inertial unit" in refused(fixes())
    assert "no GNSS receiver" in refused(samples(time_s))
    assert "no unit with three gyros" in refused(samples(time_s, rate_x_dps=None), fixes())
    assert "imu has only 0.9 s" in refused(samples(imu_times(0.9)), fixes(step_s=0.1))
    assert "no time in common" in refused(samples(time_s + 1000.0), fixes())
    never = fixes(latitude_deg=None, longitude_deg=None, velocity_north_mps=None, fix=np.full(60, "none"))
    assert "never had a fix" in refused(samples(time_s), replace(never, columns={"fix": never.columns["fix"]}))


# ---- receiver


def with_gnss(*tables: Table, **settings: Any) -> Gathered:
    return gathered(increments(imu_times()), *tables, **settings)


def test_sigmas_by_axis_come_first() -> None:
    axes = {
        "position_north_sigma_m": np.full(60, 0.5),
        "position_east_sigma_m": np.full(60, 0.25),
        "vertical_sigma_m": np.full(60, 1.5),
        "horizontal_sigma_m": np.full(60, 9.0),
        "velocity_north_sigma_mps": np.full(60, 0.05),
        "velocity_east_sigma_mps": np.full(60, 0.06),
        "velocity_down_sigma_mps": np.full(60, 0.07),
        "velocity_sigma_mps": np.full(60, 9.0),
    }
    found = with_gnss(fixes(**axes))
    assert np.allclose(found.gnss.position_sigma_m, [0.5, 0.25, 1.5])
    assert np.allclose(found.gnss.velocity_sigma_mps, [0.05, 0.06, 0.07])
    assert found.gnss_facts.position_sigma_from == "by axis, as logged"


def test_a_sigma_of_north_and_east_together_is_divided() -> None:
    found = with_gnss(fixes(horizontal_sigma_m=np.full(60, np.sqrt(2.0)), velocity_sigma_mps=np.full(60, np.sqrt(2.0))))
    assert np.allclose(found.gnss.position_sigma_m[:, :2], 1.0) and np.allclose(
        found.gnss.velocity_sigma_mps[:, :2], 1.0
    )
    assert found.gnss_facts.position_sigma_from == "horizontal and vertical, as logged"


def test_dilution_and_the_kind_of_fix_where_no_sigma_is_logged() -> None:
    found = with_gnss(fixes(hdop=np.full(60, 2.0), pdop=np.full(60, 2.5)))
    assert found.gnss_facts.position_sigma_from == "dilution times a class figure"
    assert np.allclose(found.gnss.position_sigma_m, [4.0, 4.0, 3.0])  # 2 m x 2; down 2 m x sqrt(2.5^2 - 2^2)
    kinds = np.where(np.arange(60) < 30, "rtk_fixed", "rtk_float")
    found = with_gnss(fixes(fix=kinds, hdop=np.full(60, 2.0), horizontal_sigma_m=np.zeros(60)))
    assert found.gnss_facts.position_sigma_from == "class figure of the kind of fix"
    assert np.allclose(found.gnss.position_sigma_m[[0, 59], 0], [0.02, 0.4]) and found.gnss.is_precise.all()


def test_velocity_of_track_and_speed() -> None:
    speed, track = np.full(60, 10.0), np.full(60, 90.0)
    speed[0], track[0] = 0.0, np.nan
    none = {"velocity_north_mps": None, "velocity_east_mps": None, "velocity_down_mps": None}
    found = with_gnss(fixes(**none, track_deg=track, ground_speed_mps=speed))
    assert np.allclose(found.gnss.velocity_mps[1:, :2], [0.0, 10.0]) and np.isnan(found.gnss.velocity_mps[:, 2]).all()
    assert found.gnss.velocity_mps[0, :2].tolist() == [0.0, 0.0]
    assert {"track_and_speed", "no_vertical_velocity"} <= codes(found).keys()


def test_height_above_the_sea_where_there_is_no_other() -> None:
    found = with_gnss(fixes(altitude_ellipsoid_m=None, altitude_msl_m=np.full(60, 120.0)))
    assert found.gnss_facts.height == "msl" and found.gnss.height_m[0] == 120.0 and "height_msl" in codes(found)


def test_what_is_no_fix_is_left_out() -> None:
    kinds = np.full(60, "3d", dtype="U20")
    kinds[:10], kinds[10:15], kinds[15:20] = "none", "dead_reckoning", "2d"
    latitude = 55.0 + 1e-4 * np.arange(60.0)
    latitude[20:22] = 0.0
    longitude = np.full(60, 37.0)
    longitude[20:22] = 0.0
    found = with_gnss(fixes(fix=kinds, latitude_deg=latitude, longitude_deg=longitude))
    assert len(found.gnss) == 60 - 10 - 5 - 2
    told = codes(found)
    assert (told["no_fix"], told["dead_reckoning"], told["flat_fixes"]) == (12, 5, 5)
    assert np.isnan(found.gnss.height_m[:5]).all() and np.isfinite(found.gnss.height_m[5:]).all()
    assert np.isnan(found.gnss.velocity_mps[:5, 2]).all() and np.isfinite(found.gnss.velocity_mps[:5, 0]).all()


def test_fixes_out_of_an_ins_are_told_and_avoided() -> None:
    blended = fixes(fix=np.full(60, "gnss_ins"))
    assert next(note for note in with_gnss(blended).notes if note.code == "blended").is_doubt
    found = with_gnss(blended, fixes("gnss.1", fix=np.full(60, "3d")))
    assert found.gnss_facts.topic == "gnss.1" and "blended" not in codes(found)
    assert with_gnss(blended, fixes("gnss.1"), gnss_topic="gnss").gnss_facts.topic == "gnss"
    assert "no topic gnss.7" in refused(increments(imu_times()), blended, gnss_topic="gnss.7")


def test_repeated_fixes_are_left_out() -> None:
    each = fixes(step_s=0.5)
    held = np.repeat(np.arange(0, len(each), 2), 2)
    made = replace(each, columns={name: column.take(held) for name, column in each.columns.items()})
    found = with_gnss(made)
    assert codes(found)["stuck_fixes"] == len(each) // 2 and found.gnss_facts.rate_hz == pytest.approx(1.0)
    once = fixes()
    twice = np.repeat(np.arange(len(once)), 2)
    assert codes(with_gnss(once.take(twice)))["repeated_times"] == 60


def test_a_receiver_that_stands_may_repeat_itself() -> None:
    still = {"latitude_deg": np.full(60, 55.0), "velocity_north_mps": np.zeros(60)}
    assert len(with_gnss(fixes(**still)).gnss) == 60
    assert "keeps one place" in refused(increments(imu_times()), fixes(latitude_deg=np.full(60, 55.0)))


def test_excluded_intervals_are_taken_out() -> None:
    known = Known(Phases((), "none"), intervals=(Interval(10.0, 20.0, "exclude"),))
    found = with_gnss(fixes(), known=known)
    assert not ((found.gnss.time_s > 10.0) & (found.gnss.time_s < 20.0)).any() and codes(found)["excluded"] == 10


def test_time_shifted_by_days_changes_nothing() -> None:
    shift = 10**15
    tables = (samples(imu_times()), fixes())
    later = {one.topic: replace(one, time_ns=one.time_ns + shift) for one in tables}
    found = gather(Flight(later, start_ns=shift), Known(Phases((), "none")), InputSettings())
    before = gathered(*tables)
    assert np.array_equal(found.imu.delta_angle_rad, before.imu.delta_angle_rad)
    assert np.array_equal(found.gnss.time_s, before.gnss.time_s)


def _text(found: Gathered, code: str) -> str:
    return next(note.text for note in found.notes if note.code == code)
