"""Ledger of the topic `imu`: jitter, saturation, clipping, time covered, stuck axes, NaN and disorder."""

import numpy as np
import pytest

from groundstation.base.records import Column, Item, LogHeader, RecordBatch
from groundstation.base.units import DEG_PER_RAD, NS_PER_S
from groundstation.integrity.inertial import FEWEST_ALIKE, InertialTally
from groundstation.integrity.ledger_findings import ledger_findings
from groundstation.integrity.survey import Survey, survey

RATE_HZ = 100


def batch(columns: dict[str, np.ndarray], time_ns: np.ndarray | None = None, first: int = 0) -> RecordBatch:
    count = len(next(iter(columns.values())))
    index = np.arange(first, first + count)
    time_ns = index * NS_PER_S // RATE_HZ if time_ns is None else time_ns
    return RecordBatch("imu", index, Column(time_ns), {name: Column(values) for name, values in columns.items()})


def noise(count: int = 2_000, scale: float = 1.0, seed: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).normal(scale=scale, size=count).astype(np.float32)


def found(*items: Item) -> Survey:
    return survey([LogHeader("test", utc_of_zero_ns=0), *items])


def entry(result: Survey):
    return next(topic for topic in result.ledger.topics if topic.topic == "imu")


def at_end(result: Survey, name: str) -> int:
    return next(one.at_end for one in entry(result).fields if one.name == name)


def test_jitter_is_that_of_the_steps_without_gaps() -> None:
    rng = np.random.default_rng(1)
    late_ns = rng.normal(scale=1e6, size=3_000).astype(np.int64)
    time_ns = np.arange(3_000) * 10_000_000 + late_ns + np.where(np.arange(3_000) > 1_500, 20 * NS_PER_S, 0)
    topic = entry(found(batch({"rate_x_dps": noise(3_000)}, time_ns)))
    assert topic.jitter_s == pytest.approx(np.sqrt(2.0) * 1e-3, rel=0.05), "of a difference of two stamps"
    assert len(topic.gaps) == 1


def test_other_topics_have_no_jitter() -> None:
    one = batch({"rate_x_dps": noise()})
    result = found(RecordBatch("ins", one.record_index, one.device_time_ns, dict(one.columns)))
    assert result.ledger.topics[0].jitter_s is None


@pytest.mark.parametrize("size", [2_000, 7, 50])
def test_saturation_does_not_depend_on_the_batches(size: int) -> None:
    values = noise(scale=50.0)
    values = np.clip(values, -150.0, 150.0)
    values[100:110] = 250.0  # the plateau
    values[300:302] = 250.0  # two in a row may be chance
    values[700:704] = -260.0
    tally = InertialTally()
    for start in range(0, len(values), size):
        tally.add(batch({"rate_x_dps": values[start : start + size]}, first=start))
    assert tally.at_end("rate_x_dps") == 14 and FEWEST_ALIKE == 3


def test_a_larger_value_shows_that_a_plateau_was_none() -> None:
    values = noise(scale=20.0)
    values[100:110], values[500] = 250.0, 300.0
    assert at_end(found(batch({"rate_x_dps": values})), "rate_x_dps") == 0


def test_resolution_is_no_saturation() -> None:
    coarse = np.round(noise(scale=0.3))
    assert coarse.max() == np.sort(coarse)[-20]
    result = found(batch({"rate_x_dps": coarse, "accel_z_mps2": np.float32(-9.8) + coarse}))
    assert at_end(result, "rate_x_dps") == at_end(result, "accel_z_mps2") == 0


def test_saturation_of_increments_is_told_by_their_rates() -> None:
    interval = np.float32(0.005) + noise(scale=1e-5)
    rate = np.clip(noise(scale=100.0), -500.0, 499.0) / DEG_PER_RAD
    rate[200:205] = 2_000.0 / DEG_PER_RAD
    angles = (rate * interval).astype(np.float32)
    assert at_end(found(batch({"delta_angle_z_rad": angles, "interval_s": interval})), "delta_angle_z_rad") == 5


def test_clipping_counts_and_findings() -> None:
    clipping = np.zeros(2_000, dtype=np.float32)
    clipping[[5, 9, 800]] = (1.0, 3.0, 2.0)
    columns = {"delta_velocity_x_mps": noise(), "accel_clipping": clipping, "interval_s": np.full(2_000, 0.004)}
    result = found(batch(columns))
    assert at_end(result, "accel_clipping") == 3
    assert entry(result).increments_share == pytest.approx(0.4, rel=1e-3)
    told = {one.code: one for one in ledger_findings(result.ledger)}
    assert told["values.saturated"].count == 3 and told["values.saturated"].severity == "warn"
    assert "cover 40 % of the time" in told["data.increments"].text
    document = result.ledger.document().topics["imu"]
    assert document.increments_share == pytest.approx(0.4, rel=1e-3) and document.fields["accel_clipping"].at_end == 3


def test_a_stuck_axis_nan_and_disorder_are_counted() -> None:
    stuck, broken, time_ns = noise(), noise(seed=4), np.arange(2_000) * NS_PER_S // RATE_HZ
    stuck[500:1_500] = stuck[500]
    broken[[3, 4]] = np.nan
    time_ns[1_700] = time_ns[1_699]
    time_ns[[1_800, 1_801]] = time_ns[[1_801, 1_800]]
    topic = entry(found(batch({"rate_x_dps": stuck, "rate_y_dps": broken}, time_ns)))
    by_name = {one.name: one for one in topic.fields}
    assert len(by_name["rate_x_dps"].stuck) == 1 and by_name["rate_x_dps"].stuck[0].samples == 1_000
    assert by_name["rate_y_dps"].nan == 2 and topic.duplicates == 1 and topic.backward_steps == 1
