"""Airliner recordings in HDF5: units, signs, times, masks; damage and hostile files; the facts of the recorded ones."""

import os
import struct
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
from groundstation.readers.flightdata_hdf5 import container
from tests.readers.flightdata_writer import START_UTC_S, write_flightdata
from tests.readers.test_contract import check
from tests.readers.test_flat_csv import Read
from tests.real_logs import real_log

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


def test_gear_of_one_side_and_a_wheel_serve_where_there_is_no_common_one(tmp_path: Path) -> None:
    parameters = {"Gear (L) On Ground": ramp(1.0, 0.0), "Wheel Speed (L)": ramp(100.0, 0.0, units="kts")}
    log = Read(write_flightdata(tmp_path / "l.h5", parameters))
    assert log.values("discrete", "weight_on_wheels")[0] == 1.0
    assert log.values("discrete.wheel", "wheel_speed_mps")[0] == pytest.approx(100.0 * MPS_PER_KNOT)


def test_flaps_legs_fans_and_wind(tmp_path: Path) -> None:
    parameters = {
        "Airspeed": ramp(130.0, 0.0, units="kts"),
        "Wind Direction": ramp(270.0, 0.0, frequency=0.25, units="deg"),
        "Wind Speed": ramp(20.0, 0.0, frequency=0.25, units="kts"),
        "Flap (L)": ramp(30.0, 0.0, frequency=0.5, units="deg"),
        "Gear (N) Down": ramp(1.0, 0.0, frequency=0.25),
        "Gear (L) Down": ramp(0.0, 0.0, frequency=0.25),
        "Eng (2) N1": ramp(43.0, 0.0, units="%"),
    }
    log = Read(write_flightdata(tmp_path / "log.h5", parameters))
    assert log.values("air", "wind_east_mps")[0] == pytest.approx(20.0 * MPS_PER_KNOT)  # it blows from the west
    assert log.values("air", "wind_north_mps")[0] == pytest.approx(0.0, abs=1e-9)
    assert log.values("configuration", "flap_deg")[0] == 30.0
    assert log.values("configuration", "gear_nose_down")[0] == 1.0
    assert log.values("configuration", "gear_left_down")[0] == 0.0
    assert log.values("engine.2", "n1_share")[0] == pytest.approx(0.43)
    parameters["Flap (L)"] = ramp(30.0, 0.0, frequency=0.5, units="furlong")
    path = write_flightdata(tmp_path / "odd.h5", parameters)
    assert "flap_deg" not in fields(Read(path), "configuration") and "is in furlong" in texts(path)


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


def never_written(group: Any) -> None:
    del group["data"], group["mask"]
    for part in ("data", "mask"):
        group.create_dataset(part, shape=(20,), dtype="u1")


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


def other_dataset(group: Any) -> None:
    del group["data"]
    layout = h5py.VirtualLayout(shape=(20,), dtype="f8")
    layout[:] = h5py.VirtualSource("/etc/hostname", "data", shape=(20,))
    group.create_virtual_dataset("data", layout)


def circle(group: Any) -> None:
    del group["data"]
    group["data"] = h5py.SoftLink("/series/Latitude/data")


def packed_twice(group: Any) -> None:
    del group["data"]
    layout = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    layout.set_chunk((20,))
    layout.set_deflate(9)
    layout.set_deflate(9)
    h5py.h5d.create(group.id, b"data", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((20,)), layout)


def rare_filter(group: Any) -> None:
    del group["data"]
    group.create_dataset("data", data=np.zeros(20, dtype="i8"), chunks=(20,), scaleoffset=0)


def vast_piece(group: Any) -> None:
    del group["data"]
    group.create_dataset("data", shape=(20,), maxshape=(None,), chunks=(1 << 28,), dtype="f8", compression="gzip")


def references(group: Any) -> None:
    del group["data"]
    group.create_dataset("data", data=np.array([group.ref] * 20, dtype=h5py.ref_dtype))


def text_data(group: Any) -> None:
    del group["data"]
    group.create_dataset("data", data=np.array([b"a"] * 20))


def no_rate(group: Any) -> None:
    group.attrs["frequency"] = np.bytes_(b"\xff\xfe")


def vast_rate(group: Any) -> None:
    group.attrs.create("frequency", np.ones(1 << 12))  # 32 kB: a number is its first value
    group.attrs.create("supf_offset", np.zeros((1, 1)))
    group.attrs.create("frequency", np.ones(10, dtype=[("a", "f8"), ("b", "f8")]))


def endless_rate(group: Any) -> None:
    group.attrs["frequency"] = 1e9


HOSTILE = (
    (break_mask, "no mask"),
    (shorten_mask, "3 samples of its mask"),
    (huge, "more than the file can hold"),
    (never_written, "data never written"),
    (no_pieces, "data never written"),
    (elsewhere, "link"),
    (other_storage, "another file"),
    (other_dataset, "another file"),
    (circle, "data that is a link"),
    (packed_twice, "filters that are not read (1, 1)"),
    (rare_filter, "filters that are not read (6)"),
    (vast_piece, "in pieces of 268435456 samples"),
    (references, "no row of numbers"),
    (text_data, "no row of numbers"),
    (no_rate, "a rate of nan"),
    (vast_rate, "a rate of nan"),
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


def test_links_are_not_followed(tmp_path: Path) -> None:
    path, pipe = plain(tmp_path / "log.hdf5"), tmp_path / "pipe"
    os.mkfifo(pipe)  # to open it would wait for ever
    with h5py.File(path, "a") as file:
        file["series/Pitch"] = h5py.ExternalLink(str(pipe), "/Pitch")
        file["series/Roll"] = h5py.SoftLink("/series/Roll")
    assert {one.place for one in Read(path).damages} == {"parameter Pitch", "parameter Roll"}


def test_a_parameter_of_many_names_is_read_a_few_times(tmp_path: Path) -> None:
    path = write_flightdata(tmp_path / "log.hdf5", {"Pitch": ramp(0.0, 1.0)})
    with h5py.File(path, "a") as file:
        for number in range(100):
            file[f"series/Z{number}"] = file["series/Pitch"]
    log = Read(path)
    assert len(log.topics) == 1 + container.MOST_NAMES and not log.damages


@pytest.mark.parametrize("compression", ["gzip", "lzf", None])
def test_pieces_never_written_are_missing_and_counted(tmp_path: Path, compression: str | None) -> None:
    path = write_flightdata(tmp_path / "log.hdf5", {"Pitch": ramp(0.0, 1.0)})
    with h5py.File(path, "r+") as file:
        group = file["series/Pitch"]
        del group["data"]
        data = group.create_dataset("data", shape=(ROWS,), chunks=(4,), dtype="f8", compression=compression)
        data[:8], data[16:] = np.arange(8.0), np.arange(16.0, 20.0)
    log = Read(path)
    assert log.values("raw.Pitch", "value") == [*np.arange(8.0), *np.arange(16.0, 20.0)]
    lost = log.damage("corrupt")
    assert lost.count == 8 and "Pitch" in lost.place and "never written" in lost.what


def test_a_corrupt_piece_costs_its_own_samples_alone(tmp_path: Path) -> None:
    path = write_flightdata(tmp_path / "log.hdf5", {"Pitch": ramp(0.0, 1.0)})
    with h5py.File(path, "r+") as file:
        group = file["series/Pitch"]
        del group["data"]
        data = group.create_dataset("data", data=np.arange(float(ROWS)), chunks=(4,), compression="gzip")
        data.id.write_direct_chunk((8,), b"no deflated piece")
    log = Read(path)
    assert log.values("raw.Pitch", "value") == [*np.arange(8.0), *np.arange(12.0, 20.0)]
    assert log.damage("corrupt").count == 4 and "does not unpack" in log.damage("corrupt").what


def test_of_a_cut_file_data_in_one_block_are_read_as_far_as_they_go(tmp_path: Path) -> None:
    path = write_flightdata(tmp_path / "log.hdf5", {"Pitch": ramp(0.0, 1.0)})
    with h5py.File(path, "r+") as file:
        group = file["series/Pitch"]
        del group["data"], group["mask"]
        group["mask"] = np.zeros(1000, dtype=bool)
        group["data"] = np.arange(1000.0)
        end = group["data"].id.get_offset() + 8 * 600
    path.write_bytes(path.read_bytes()[:end])
    log = Read(path)
    assert log.values("raw.Pitch", "value") == list(np.arange(600.0))
    assert log.damage("corrupt").count == 400 and "cut off" in log.damage("corrupt").what


def write_bomb(path: Path, parameters: int, samples: int) -> Path:
    """A small file of zeros that holds many more samples than its bytes."""
    with h5py.File(path, "w") as file:
        series = file.create_group("series")
        for number in range(parameters):
            group = series.create_group(f"P{number:03d}")
            group.attrs["frequency"], group.attrs["supf_offset"] = 128.0, 0.0
            for part in ("data", "mask"):
                zeros = np.zeros(samples, dtype="u1")
                group.create_dataset(part, data=zeros, chunks=(samples,), compression="gzip", compression_opts=9)
    return path


def test_the_sum_of_what_is_read_is_bounded_by_the_size_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_bomb(tmp_path / "log.hdf5", parameters=40, samples=60_000)
    monkeypatch.setattr(container, "FREE_BYTES", 1 << 20)
    log = Read(path)
    rows = sum(len(batch) for batch in log.batches)
    assert 60_000 <= rows <= (container.FREE_BYTES + container.MOST_EXPANSION * path.stat().st_size) / 9
    refused = [one for one in log.damages if one.kind == "dropped_channel"]
    assert len(refused) == 40 - len(log.topics) and all("more than the file can hold" in one.what for one in refused)


def test_data_that_lie_in_one_another_are_read_up_to_the_size_of_the_file(tmp_path: Path) -> None:
    path = write_flightdata(tmp_path / "log.hdf5", {"Pitch": ramp(0.0, 1.0)})
    with h5py.File(path, "a") as file:
        for part in ("data", "mask"):
            del file["series/Pitch"][part]
            file["series/Pitch"][part] = np.zeros(4096)
        for number in range(20):
            group = file["series"].create_group(f"Z{number:02d}")
            group.attrs["frequency"], group.attrs["supf_offset"] = 1.0, 0.0
            for part in ("data", "mask"):
                group[part] = file["series/Pitch"][part]
    log = Read(path)
    assert len([topic for topic in log.topics if topic.startswith("raw.")]) == 1
    assert sum("more than the file can hold" in one.what for one in log.damages) == 20


def test_slow_parameters_of_a_long_recording_are_read_in_few_slices(tmp_path: Path) -> None:
    slow = {f"P{number}": ramp(0.0, 1.0, frequency=1 / 4096, offset=float(number)) for number in range(5)}
    log = Read(write_flightdata(tmp_path / "log.hdf5", slow))
    assert len(log.batches) == 5 and all(len(batch) == ROWS for batch in log.batches)


def test_heaps_that_lie_in_one_another_are_refused(tmp_path: Path) -> None:
    path = plain(tmp_path / "log.hdf5")
    empty, many = struct.pack("<HHIQ", 1, 0, 0, 0), 1_000
    size = path.stat().st_size
    heads = b"".join(
        b"GCOL\x01\0\0\0" + struct.pack("<QHHIQ", 32 * many, 1, 0, 0, 32 * (many - at - 1)) for at in range(many)
    )
    with path.open("ab") as file:
        file.write(heads + 2 * many * empty)
    assert path.stat().st_size == size + 64 * many
    with pytest.raises(UnreadableLogError, match="heaps of text that lie in one another"):
        list(registry.read(path))


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
