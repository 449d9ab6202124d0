"""Canonical numbers are the raw ones by their documented factors, in recorded, written and damaged streams."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.base.records import Column, RecordBatch
from groundstation.readers import registry
from tests.readers.receiver_writer import nmea_log, novatel_log, ubx_log
from tests.real_logs import real_log

MM, CM, KNOT = 1e-3, 1e-2, 1852.0 / 3600.0
_PLACE = {"latitude_deg": ("lat", 1.0), "longitude_deg": ("lon", 1.0)}
_UBX_PLACE = _PLACE | {
    "altitude_ellipsoid_m": ("height", MM),
    "altitude_msl_m": ("hMSL", MM),
    "horizontal_sigma_m": ("hAcc", MM),
    "vertical_sigma_m": ("vAcc", MM),
}
_VELOCITY = {f"velocity_{axis}_mps": (f"vel{axis[0].upper()}", MM) for axis in ("north", "east", "down")}
_SPEED = {"ground_speed_mps": ("gSpeed", MM), "velocity_sigma_mps": ("sAcc", MM), "satellites_used": ("numSV", 1.0)}
# Raw topic -> the canonical topic of its rows, and of each field the raw field and its factor by the makers' documents.
FACTORS: dict[str, tuple[str, dict[str, tuple[str, float]]]] = {
    "raw.NAV-PVT": ("gnss", {**_UBX_PLACE, **_VELOCITY, **_SPEED, "pdop": ("pDOP", 1.0)}),
    "raw.NAV-PVAT": ("gnss", {**_UBX_PLACE, **_VELOCITY, **_SPEED}),
    "raw.NAV-ATT": ("ins", {"roll_deg": ("roll", 1.0), "pitch_deg": ("pitch", 1.0)}),
    "raw.GNGGA": (
        "gnss",
        {**_PLACE, "altitude_msl_m": ("alt", 1.0), "hdop": ("HDOP", 1.0), "satellites_used": ("numSV", 1.0)},
    ),
    "raw.PASHR": (
        "ins",
        {"roll_deg": ("roll", 1.0), "pitch_deg": ("pitch", 1.0), "true_heading_sigma_deg": ("hdgAcc", 1.0)},
    ),
    "raw.BESTPOS": (
        "gnss",
        {
            "latitude_deg": ("latitude", 1.0),
            "longitude_deg": ("longitude", 1.0),
            "altitude_msl_m": ("orthometric_height", 1.0),
            "satellites_used": ("num_soln_svs", 1.0),
        },
    ),
    "raw.INSPVAS": (
        "ins",
        {"velocity_north_mps": ("north_vel", 1.0), "roll_deg": ("roll", 1.0), "pitch_deg": ("pitch", 1.0)},
    ),
}
FINER = {"latitude_deg", "longitude_deg", *_UBX_PLACE}  # of NAV-HPPOSLLH where it is of the same epoch
RECORDED = (
    "gnss/walk_0827_gnss_1730.ubx",
    "gnss/ublox_ins_drive_pvat.ubx",
    "gnss/inertialsense_Serial38400.nmea",
    "gnss/pygpsdata-MIXED.log",
    "cases/n4_pashr_kinds.nmea",
)
BYTES, MUTATED = 120_000, 60


def columns_of(batches: list[RecordBatch], topic: str, name: str) -> tuple[np.ndarray, Column]:
    """Places and values of a field, over all batches of a topic that have it."""
    having = [batch for batch in batches if batch.topic == topic and name in batch.columns]
    nothing = np.zeros(0)
    places = np.concatenate([nothing.astype(np.int64), *(batch.record_index for batch in having)])
    values = np.concatenate([nothing, *(batch.columns[name].values.astype(np.float64) for batch in having)])
    return places, Column(
        values, np.concatenate([nothing.astype(bool), *(batch.columns[name].mask for batch in having)])
    )


def assert_factors(path: Path) -> int:
    """Compare each canonical value with the raw one at its place in the file; returns how many there were."""
    batches = [item for item in registry.read(path) if isinstance(item, RecordBatch)]
    has_finer = any(batch.topic == "raw.NAV-HPPOSLLH" for batch in batches)
    compared = 0
    for raw_topic, (topic, fields) in FACTORS.items():
        for name, (raw_name, factor) in fields.items():
            if has_finer and name in FINER:
                continue
            places, canonical = columns_of(batches, topic, name)
            raw_places, raw = columns_of(batches, raw_topic, raw_name)
            _both, at, raw_at = np.intersect1d(places, raw_places, return_indices=True)
            told = canonical.mask[at]
            assert raw.mask[raw_at][told].all(), (topic, name, "a value that the device did not write")
            ours, theirs = canonical.values[at][told], raw.values[raw_at][told] * factor
            assert np.allclose(ours, theirs, rtol=1e-12, atol=0.0, equal_nan=True), (topic, name)
            compared += int(told.sum())
    return compared


def mutated(content: bytes, seed: int) -> bytes:
    """A stream with some bytes changed, cut out or doubled."""
    rng, data = np.random.default_rng(seed), bytearray(content)
    for _ in range(MUTATED):
        at, length = int(rng.integers(len(data))), int(rng.integers(1, 40))
        match int(rng.integers(3)):
            case 0:
                data[at] = int(rng.integers(256))
            case 1:
                del data[at : at + length]
            case _:
                data[at:at] = data[at : at + length]
    return bytes(data)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("writer", [ubx_log, nmea_log, novatel_log])
def test_written_streams(tmp_path: Path, writer: object, seed: int) -> None:
    path = tmp_path / "log"
    content = writer()  # type: ignore[operator]
    path.write_bytes(mutated(content, seed) if seed else content)
    assert assert_factors(path) > 100


@pytest.mark.real_log
@pytest.mark.parametrize("name", RECORDED)
@pytest.mark.parametrize("seed", range(3))
def test_recorded_streams(tmp_path: Path, name: str, seed: int) -> None:
    path = tmp_path / "log"
    content = real_log(name).read_bytes()[:BYTES]
    path.write_bytes(mutated(content, seed) if seed else content)
    assert assert_factors(path) > 50
