"""Airliner recordings in HDF5: units, signs, times, masks; damage and hostile files; the facts of the recorded ones."""

import zlib
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import RecordBatch, Remark
from groundstation.base.units import MPS_PER_KNOT, NS_PER_S
from groundstation.readers import registry
from tests.flightdata_writer import START_UTC_S, write_flightdata
from tests.real_logs import real_log
from tests.test_readers_contract import check
from tests.test_readers_flat_csv import Read

ROWS = 20


def ramp(first: float, step: float, **told: Any) -> dict[str, Any]:
    return {"data": first + step * np.arange(ROWS), **told}


def plain(path: Path) -> Path:
    return write_flightdata(
        path,
        {
            "Latitude": ramp(60.0, 0.001, offset=0.75, units=b"deg"),
            "Longitude": ramp(10.0, 0.002, offset=0.5, units="deg"),
            "Heading True": {"data": np.arange(350.0, 370.0) % 360.0, "offset": 0.25},
            "Groundspeed": ramp(100.0, 0.0, offset=0.75, units="kts"),
            "Track True": ramp(90.0, 0.0, offset=0.75),
            "Acceleration Normal": ramp(1.0, 0.0, frequency=8.0),
            "ILS Localizer": ramp(1.0, 0.0, offset=0.5, units="dots"),
            "ILS Glideslope": ramp(-0.5, 0.0, offset=0.5, units="dots"),
            "Altitude Radio (A)": ramp(100.0, 0.0, frequency=0.5),
            "Gear On Ground": ramp(0.0, 0.0),
            "Flap": {"data": np.full(ROWS, 99.0), "mask": np.arange(ROWS) % 2 == 0, "lfl": False},
        },
    )


def texts(path: Path) -> str:
    """All remarks of a file."""
    return " | ".join(item.text for item in registry.read(path) if isinstance(item, Remark))


def fields(log: Read, topic: str) -> set[str]:
    return {name for batch in log.batches if batch.topic == topic for name in batch.columns}


@pytest.mark.parametrize("offset", [0.0, 0.5])
def test_zeros_are_no_position(tmp_path: Path, offset: float) -> None:
    """Beside them a longitude of other times is interpolated from one: it is none either."""
    from_fix = np.where(np.arange(ROWS) < 5, 0.0, 1.0)
    parameters = {"Latitude": {"data": 60.0 * from_fix}, "Longitude": {"data": 10.0 * from_fix, "offset": offset}}
    log = Read(write_flightdata(tmp_path / "log.hdf5", parameters))
    assert set(log.values("ins", "latitude_deg")) == {60.0} and set(log.values("ins", "longitude_deg")) == {10.0}
    assert len(log.values("raw.Latitude", "value")) == ROWS
    (damage,) = log.damages
    assert (damage.topic, damage.loses_data) == ("ins", False) and "no position" in damage.what
    assert damage.count == (5 if offset == 0.0 else 4)


def test_units_signs_and_times(tmp_path: Path) -> None:
    log = Read(plain(tmp_path / "log.hdf5"))
    assert log.header.reader == "flightdata-hdf5" and log.header.utc_of_zero_ns == START_UTC_S * NS_PER_S
    assert log.header.metadata["units.raw.Groundspeed"] == "value kts"
    assert log.times("ins")[:2] == [750_000_000, 1_750_000_000]
    assert log.values("ins", "latitude_deg")[:2] == [60.0, pytest.approx(60.001)]
    assert log.values("ins", "longitude_deg")[0] == pytest.approx(10.0005)  # a quarter of a second on
    assert log.values("ins", "true_heading_deg")[9] == pytest.approx(359.5)  # along the shorter arc
    assert log.values("ins", "ground_speed_mps")[0] == pytest.approx(100.0 * MPS_PER_KNOT)
    assert log.values("ins", "velocity_east_mps")[0] == pytest.approx(100.0 * MPS_PER_KNOT)
    assert log.values("ins.accelerometer", "accel_z_mps2")[0] == pytest.approx(-9.80665)  # level flight
    assert log.times("ins.accelerometer")[1] == 125_000_000
    assert log.values("guidance", "lateral_deviation_dots")[0] == -1.0  # left of the course
    assert log.values("guidance", "vertical_deviation_dots")[0] == -0.5  # below the path
    assert log.values("radio_altimeter.1", "height_m")[0] == pytest.approx(30.48)
    assert log.values("discrete", "weight_on_wheels")[0] == 0.0
    assert len(log.rows("raw.Flap")) == ROWS / 2, "masked samples are missing"
    said = texts(tmp_path / "log.hdf5")
    for words in ("heading plus drift", "computed by the ground software, not recorded: Flap", "brought to the times"):
        assert words in said


def test_contract_in_slices(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = plain(tmp_path / "log.hdf5")
    whole = list(registry.read(path))
    check(whole)
    monkeypatch.setattr("groundstation.readers.flightdata_hdf5.reader.SLICE_S", 3.0)
    pieces = list(registry.read(path))
    check(pieces)
    assert _rows(whole) == _rows(pieces)


def _rows(items: list[Any]) -> dict[str, list[Any]]:
    rows: dict[str, list[Any]] = {}
    for batch in items:
        if isinstance(batch, RecordBatch):
            columns = [np.where(column.mask, column.values, -1).tolist() for column in batch.columns.values()]
            rows.setdefault(batch.topic, []).extend(zip(batch.record_index.tolist(), *columns, strict=True))
    return rows


def test_an_unwrapped_heading_serves_where_there_is_no_other(tmp_path: Path) -> None:
    log = Read(write_flightdata(tmp_path / "l.h5", {"Heading True Continuous": ramp(-2014.0, 0.0)}))
    assert log.values("ins", "true_heading_deg")[0] == pytest.approx(146.0)


def test_between_a_valid_and_a_masked_sample_there_is_nothing(tmp_path: Path) -> None:
    mask = np.zeros(ROWS, dtype=bool)
    mask[5] = True
    parameters = {"Latitude": ramp(60.0, 0.0), "Pitch": ramp(1.0, 0.0, offset=0.5, mask=mask)}
    log = Read(write_flightdata(tmp_path / "l.h5", parameters))
    pitch = log.values("ins", "pitch_deg")
    assert [at for at, value in enumerate(pitch) if value is None] == [0, 5, 6]  # none before the first


def break_mask(group: Any) -> None:
    del group["mask"]


def shorten_mask(group: Any) -> None:
    del group["mask"]
    group.create_dataset("mask", data=np.zeros(3, dtype=bool))


def huge(group: Any) -> None:
    del group["data"], group["mask"]
    for part in ("data", "mask"):
        group.create_dataset(part, shape=(10**11,), dtype="f8", chunks=(1000,))


def no_pieces(group: Any) -> None:
    del group["data"], group["mask"]
    for part in ("data", "mask"):
        group.create_dataset(part, shape=(20,), dtype="f8", chunks=(10,))


def elsewhere(group: Any) -> None:
    del group["data"]
    group["data"] = h5py.ExternalLink("/etc/hostname", "/data")


def other_storage(group: Any) -> None:
    del group["data"]
    group.create_dataset("data", shape=(20,), dtype="f8", external=[("/etc/hostname", 0, 160)])


def text_data(group: Any) -> None:
    del group["data"]
    group.create_dataset("data", data=np.array([b"a"] * 20))


def no_rate(group: Any) -> None:
    group.attrs["frequency"] = np.bytes_(b"\xff\xfe")


def endless_rate(group: Any) -> None:
    group.attrs["frequency"] = 1e9


HOSTILE = (
    (break_mask, "no mask"),
    (shorten_mask, "3 samples of its mask"),
    (huge, "more than the file can hold"),
    (no_pieces, "pieces of data missing"),
    (elsewhere, "link"),
    (other_storage, "another file"),
    (text_data, "no row of numbers"),
    (no_rate, "a rate of nan"),
    (endless_rate, "a rate of 1e+09"),
)


@pytest.mark.parametrize(("harm", "words"), HOSTILE, ids=[harm.__name__ for harm, _ in HOSTILE])
def test_a_bad_parameter_is_dropped_with_its_reason_and_the_others_are_read(
    tmp_path: Path, harm: Any, words: str
) -> None:
    path = plain(tmp_path / "log.hdf5")
    with h5py.File(path, "a") as file:
        harm(file["series/Latitude"])
    log = Read(path)
    dropped = log.damage("dropped_channel")
    assert "Latitude" in dropped.place and words in dropped.what
    assert "latitude_deg" not in fields(log, "ins") and log.values("ins", "true_heading_deg")


def test_odd_text_in_names_and_units(tmp_path: Path) -> None:
    path = write_flightdata(
        tmp_path / "l.h5", {"A\u202e\nB": ramp(0.0, 1.0), "Pitch": ramp(0, 0, units=np.bytes_(b"\xe9\x00"))}
    )
    log = Read(path)
    assert "raw.A_B" in log.topics and "raw.Pitch" in log.topics


def test_a_unit_of_another_kind_is_told_and_left_raw(tmp_path: Path) -> None:
    log = Read(write_flightdata(tmp_path / "l.h5", {"Pitch": ramp(0.0, 1.0, units="ft"), "Roll": ramp(0.0, 1.0)}))
    assert "pitch_deg" not in fields(log, "ins")
    assert "Pitch is in ft" in texts(tmp_path / "l.h5")


def test_a_cut_file_gives_its_intact_part(tmp_path: Path) -> None:
    path = plain(tmp_path / "log.hdf5")
    data = path.read_bytes()
    path.write_bytes(data[: int(0.9 * len(data))])
    log = Read(path)
    assert log.damage("truncated").count == len(data) - int(0.9 * len(data))
    assert log.topics and all(np.isfinite(column.values).all() for b in log.batches for column in b.columns.values())


def test_corrupt_pieces_cost_their_parameter_alone(tmp_path: Path) -> None:
    path = plain(tmp_path / "log.hdf5")
    data = path.read_bytes()
    piece = zlib.compress((60.0 + 0.001 * np.arange(ROWS)).tobytes(), 4)
    assert data.count(piece) == 1
    path.write_bytes(data.replace(piece, bytes(len(piece))))
    log = Read(path)
    assert log.damage("corrupt").count == ROWS and "Latitude" in log.damage("corrupt").place
    assert log.values("guidance", "vertical_deviation_dots")


@pytest.mark.parametrize(("level", "samples"), [(4, ROWS - 1), (4, ROWS + 1)])
def test_a_piece_of_another_length_is_not_filled_with_memory(tmp_path: Path, level: int, samples: int) -> None:
    path = tmp_path / "log.hdf5"
    write_flightdata(path, {"Pitch": ramp(0.0, 1.0), "Roll": ramp(5.0, 1.0)})
    with h5py.File(path, "r+") as file:
        file["series/Pitch/data"].id.write_direct_chunk((0,), zlib.compress(np.arange(float(samples)).tobytes(), level))
    log = Read(path)
    assert log.damage("corrupt").count == ROWS and "Pitch" in log.damage("corrupt").place
    assert log.values("ins", "roll_deg") == pytest.approx(5.0 + np.arange(ROWS))


def test_a_heap_that_never_ends_is_read_and_told(tmp_path: Path) -> None:
    path = plain(tmp_path / "log.hdf5")
    before = [batch.columns for batch in Read(path).batches]
    data = bytearray(path.read_bytes())
    heap = data.index(b"GCOL")
    place, free, number = heap + 16, 0, 1
    while number:  # the last object is the free space
        number = int.from_bytes(data[place : place + 2], "little")
        free, length = place, int.from_bytes(data[place + 8 : place + 16], "little")
        place += 16 + -(-length // 8) * 8
    data[free + 8 : free + 16] = bytes(8)
    path.write_bytes(data)
    log = Read(path)
    assert log.damage("corrupt").place == f"byte {free + 8}" and "without an end" in log.damage("corrupt").what
    assert str([batch.columns for batch in log.batches]) == str(before)


@pytest.mark.parametrize("content", [b"\x89HDF\r\n\x1a\n series", b"\x89HDF\r\n\x1a\n\0\0\0 series" + bytes(500)])
def test_what_is_no_recording_is_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "log.hdf5"
    path.write_bytes(content)
    with pytest.raises(UnreadableLogError, match="HDF5 that cannot be opened"):
        list(registry.read(path))


def test_other_hdf5_is_not_claimed(tmp_path: Path) -> None:
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["x"] = np.arange(3)
    with pytest.raises(UnreadableLogError, match=r"HDF5 \(or MATLAB"):
        registry.read(path)


@pytest.mark.real_log
@pytest.mark.parametrize("name", ["Specimen_Flight", "coreg", "flight_with_go_around_and_landing"])
def test_recorded_files_keep_the_contract(name: str) -> None:
    check(list(registry.read(real_log(f"approach/{name}.hdf5"))))


@pytest.mark.real_log
def test_facts_of_the_recorded_files() -> None:
    oslo, coreg = Read(real_log("approach/Specimen_Flight.hdf5")), Read(real_log("approach/coreg.hdf5"))
    assert len(oslo.rows("ins")) == 2480 and len(oslo.rows("ins.accelerometer")) == 19_840
    assert "ins" in coreg.topics and "latitude_deg" not in fields(coreg, "ins")
    said = texts(real_log("approach/Specimen_Flight.hdf5"))
    assert "153 m of latitude" in said and "taken as magnetic" in said
