"""NovAtel OEM messages: fields against NovAtel's own decoder, canonical topics, times, damage."""

import time
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.readers.receiver import stream
from groundstation.readers.receiver.layouts import layout
from groundstation.readers.receiver.novatel_messages import LAYOUTS, NAMES
from tests.readers.receiver_writer import nmea, novatel, novatel_crc, novatel_frame, novatel_text, novatel_text_log, pvt
from tests.readers.test_receiver import Read

NOON_MS = 129_618_000  # of GPS week 2417: 2026-05-04 12:00:00 UTC
_RESERVED = ("rsvd_field_for_velocity_logs", "float_1", "ushort", "ulong")
NUMBERS = {name: number for number, name in NAMES.items()}
TRAILING = {"BESTVEL": 4, "BESTGNSSVEL": 4, "PSRVEL": 4}  # reserved bytes behind what the layouts name


def body_of(name: str, rng: np.random.Generator) -> bytes:
    """A body of plausible values, each another."""
    dtype = layout(LAYOUTS[name]).head.dtype
    record = np.zeros(1, dtype)
    for member in dtype.names or ():
        kind = dtype[member].kind
        if kind == "f":
            record[member] = rng.normal(scale=100.0)
        elif kind == "S":
            record[member] = b"%04d" % rng.integers(0, 9999)
        else:
            record[member] = 61 if member == "datum_id" else rng.integers(0, 4)  # WGS 84
    return record.tobytes() + bytes(TRAILING.get(name, 0))


def flat(values: list[Any]) -> list[Any]:
    found: list[Any] = []
    for value in values:
        found += list(value) if isinstance(value, list | tuple | np.ndarray) else [value]
    return found


def test_fields_equal_those_of_the_makers_decoder(tmp_path: Path) -> None:
    oem = pytest.importorskip("novatel_edie.oem")
    rng = np.random.default_rng(3)
    names = [name for name in LAYOUTS if layout(LAYOUTS[name]).group is None]
    frames = b"".join(novatel_frame(NUMBERS[name], body_of(name, rng), 2417, NOON_MS) for name in names * 3)
    read, parser, compared = Read(tmp_path, frames), oem.Parser(), 0
    parser.write(frames)
    for number, name in enumerate(names * 3):
        message = parser.read()
        assert message.name == name
        fields = message.get_field_names()
        values = zip(fields, message.get_field_values(), strict=True)
        theirs = flat([value for key, value in values if key not in _RESERVED])
        batch = read.batches(f"raw.{name}")[0]
        ours = [column.values[number // len(names)] for column in batch.columns.values()]
        assert len(theirs) == len(ours), name
        for key, their, our in zip(batch.columns, theirs, ours, strict=True):
            assert our == (their if isinstance(their, str) else float(their)), (name, key)
            compared += 1
    assert compared > 600


def bestpos(week_ms: int, status: int = 180, **members: int | float) -> bytes:
    usual = {"latitude": 51.5, "longitude": -0.7, "orthometric_height": 100.0, "undulation": 47.0, "position_type": 50}
    spread = {"latitude_std_dev": 0.03, "longitude_std_dev": 0.04, "height_std_dev": 0.08, "num_soln_svs": 14}
    return novatel("BESTPOS", week_ms, status, **(usual | spread | members))


def test_position_velocity_and_dilution_of_one_moment(tmp_path: Path) -> None:
    velocity = {"horizontal_speed": 10.0, "ground_track": 90.0, "vertical_speed": 2.0}
    content = bestpos(NOON_MS) + novatel("BESTVEL", NOON_MS, **velocity)
    content += novatel("PSRDOP", NOON_MS, gdop=1.5, pdop=1.25, hdop=0.75) + bestpos(NOON_MS + 1000, solution_status=1)
    read = Read(tmp_path, content)
    row = {name: read.values("gnss", name)[0] for name in read.batches("gnss")[0].columns}
    assert row["latitude_deg"] == 51.5 and row["altitude_ellipsoid_m"] == 147.0 and row["altitude_msl_m"] == 100.0
    assert row["velocity_east_mps"] == pytest.approx(10.0) and row["velocity_down_mps"] == -2.0
    assert row["horizontal_sigma_m"] == pytest.approx(0.05) and row["gdop"] == 1.5 and row["satellites_used"] == 14.0
    assert read.values("gnss", "fix") == ["rtk_fixed", "none"] and read.values("gnss", "latitude_deg") == [51.5, None]
    assert read.times("gnss")[0] == "2026-05-04T12:00:00.000000000Z"


def inspva(status: int, **members: int | float) -> bytes:
    values = {"week": 2417, "seconds": NOON_MS / 1e3 + 0.005, "latitude": 51.5, "longitude": -0.7, "height": 147.0}
    motion = {"north_vel": 1.0, "east_vel": 2.0, "up_vel": 3.0, "roll": 4.0, "pitch": -5.0, "azimuth": 360.0}
    return novatel("INSPVAS", NOON_MS, is_short=True, ins_solution_status=status, **(values | motion | members))


def test_inertial_solution_and_its_covariance(tmp_path: Path) -> None:
    squares = {"pos_cov_1": 0.0009, "pos_cov_5": 0.0016, "pos_cov_9": 0.0064}
    squares |= {"att_cov_1": 0.01, "att_cov_5": 0.04, "att_cov_9": 0.09}
    covariance = novatel("INSCOVS", NOON_MS, is_short=True, week=2417, seconds=NOON_MS / 1e3, **squares)
    read = Read(tmp_path, bestpos(NOON_MS) + inspva(3) + covariance)
    row = {name: read.values("ins", name)[0] for name in read.batches("ins")[0].columns}
    assert (row["velocity_north_mps"], row["velocity_east_mps"], row["velocity_down_mps"]) == (1.0, 2.0, -3.0)
    assert (row["roll_deg"], row["pitch_deg"], row["true_heading_deg"]) == (4.0, -5.0, 0.0)
    assert row["true_heading_sigma_deg"] == pytest.approx(0.3) and row["roll_sigma_deg"] == pytest.approx(0.2)
    assert row["horizontal_sigma_m"] == pytest.approx(0.05) and row["altitude_ellipsoid_m"] == 147.0
    assert row["mode"] == "gnss_aided" and read.header.metadata["ins_kind"] == "gnss_aided"
    assert read.times("ins") == ["2026-05-04T12:00:00.005000000Z"]


@pytest.mark.parametrize(("status", "mode"), [(1, "align"), (6, "nav"), (7, "gnss_aided"), (0, None)])
def test_mode_of_the_inertial_solution(tmp_path: Path, status: int, mode: str | None) -> None:
    read = Read(tmp_path, inspva(status))
    assert read.values("ins", "mode") == [mode]
    assert read.values("ins", "roll_deg") == [4.0 if mode in ("nav", "gnss_aided") else None]


def test_heading_of_two_antennas(tmp_path: Path) -> None:
    content = bestpos(NOON_MS) + novatel("HEADING2", NOON_MS, heading=123.5, heading_std_dev=0.25, position_type=50)
    read = Read(tmp_path, content + novatel("HEADING2", NOON_MS + 1000, heading=1.0, solution_status=1))
    assert read.values("ins", "true_heading_deg") == [123.5] and read.values("ins", "true_heading_sigma_deg") == [0.25]


def test_a_time_that_the_receiver_does_not_know_is_absent(tmp_path: Path) -> None:
    read = Read(tmp_path, bestpos(5_000, status=20) + bestpos(NOON_MS))
    assert read.times("gnss") == [None, "2026-05-04T12:00:00.000000000Z"]


def test_frames_beside_sentences_and_damaged_ones(tmp_path: Path) -> None:
    bad = bytearray(bestpos(NOON_MS))
    bad[60] ^= 1
    read = Read(tmp_path, bestpos(NOON_MS) + nmea("GPHDT,1.0,T") + bytes(bad) + bestpos(NOON_MS + 1000) + b"\xaaD\x12")
    assert len(read.times("gnss")) == 2 and read.values("ins", "true_heading_deg") == [1.0]
    assert [one.count for one in read.damages] == [len(bad), 3]


def test_messages_that_are_not_known_and_answers_keep_their_bytes(tmp_path: Path) -> None:
    unknown = novatel_frame(5555, b"\x01\x02\x03", 2417, NOON_MS)
    answer = bytearray(bestpos(NOON_MS))[:-4]
    answer[6] = 0x80
    content = bytes(answer) + (zlib.crc32(bytes(answer), 0xFFFFFFFF) ^ 0xFFFFFFFF).to_bytes(4, "little")
    read = Read(tmp_path, pvt("2026-05-04T12:00:00Z") + unknown + content)
    assert read.values("raw.NOVATEL-5555", "payload") == ["010203"]
    assert len(read.batches("raw.BESTPOS-answer")) == 1 and not read.batches("raw.BESTPOS")


def test_the_makers_text_gives_what_its_binary_form_gives(tmp_path: Path) -> None:
    """Every message with a layout, written as text by NovAtel's own encoder; digits of text are fewer."""
    oem = pytest.importorskip("novatel_edie.oem")
    rng = np.random.default_rng(19)
    names = [name for name in LAYOUTS if layout(LAYOUTS[name]).group is None]
    frames = b"".join(novatel_frame(NUMBERS[name], body_of(name, rng), 2417, NOON_MS) for name in names)
    parser, texts = oem.Parser(), b""
    parser.write(frames)
    for _name in names:
        texts += bytes(parser.read().to_ascii().message)
    assert texts.count(b"\n#") == len(names) - 1
    binary, text = Read(tmp_path, frames), Read(tmp_path, texts)
    assert not text.damages
    for name in names:
        of_text, of_binary = (one.batches(f"raw.{name}")[0] for one in (text, binary))
        assert of_text.columns.keys() == of_binary.columns.keys()
        for key, column in of_binary.columns.items():
            if column.values.dtype.kind == "f":
                np.testing.assert_allclose(of_text.columns[key].values, column.values, rtol=1e-4, atol=1e-3)
            else:
                assert of_text.columns[key].values.tolist() == column.values.tolist(), (name, key)
    assert text.times("gnss") == binary.times("gnss") and text.times("ins") == binary.times("ins")


def test_a_drive_in_text_becomes_gnss_and_ins(tmp_path: Path) -> None:
    read = Read(tmp_path, novatel_text_log())
    assert read.values("gnss", "latitude_deg")[-1] == pytest.approx(55.0019)
    assert read.values("gnss", "altitude_ellipsoid_m")[0] == 135.0 and read.values("gnss", "fix")[0] == "3d"
    assert read.values("gnss", "velocity_east_mps")[0] == pytest.approx(10.0)
    assert read.values("gnss", "velocity_down_mps")[0] == 1.0
    assert read.times("gnss")[0] == "2026-05-04T12:00:00.000000000Z"
    assert read.values("ins", "true_heading_deg") == [90.5] * 20 and read.values("ins", "mode")[0] == "gnss_aided"
    assert read.times("ins")[1] == "2026-05-04T12:00:01.000000000Z"


def test_epochs_of_text_come_together_whatever_the_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream, "BLOCK_BYTES", 20_000)
    whole = Read(tmp_path, novatel_text_log(600))
    assert len(whole.batches("gnss")) > 3
    assert len(whole.values("gnss", "velocity_east_mps")) == 600
    assert None not in whole.values("gnss", "velocity_east_mps")


def test_damaged_text_is_skipped_and_odd_text_kept(tmp_path: Path) -> None:
    sound = novatel_text_log(10)
    damaged = sound.replace(b"55.0003,37.5", b"56.0003,37.5")
    read = Read(tmp_path, damaged)
    assert len(read.values("gnss", "latitude_deg")) == 9 and sum(one.count for one in read.damages) > 100
    header = "COM1,0,80.0,FINESTEERING,2417,129700.000,02000020,1234,16809"
    odd = novatel_text(f"BESTPOSA,{header}", "WHAT,SINGLE,1.0") + novatel_text(f"ODDA,{header}", "1,2,3")
    kept = Read(tmp_path, sound + odd)
    assert not kept.damages and len(kept.values("gnss", "latitude_deg")) == 10
    assert bytes.fromhex(kept.values("raw.ODD-text", "payload")[0]) == b"1,2,3"
    assert bytes.fromhex(kept.values("raw.BESTPOS-text", "payload")[0]) == b"WHAT,SINGLE,1.0"


@pytest.mark.parametrize(
    "text",
    [
        b"#A,;*",
        b"#BESTPOSA,;",
        b"#BESTPOSA," + b"1," * 40_000,
        b"%INSPVASA,99999999999,1e999;1",
        b"#BESTPOSA;" + b";" * 900,
        b"#BESTPOSA,COM1,0,1,FINE,2417,999999.999999999,0,0,0;" + b"9" * 500,
    ],
)
def test_hostile_text_raises_nothing(tmp_path: Path, text: bytes) -> None:
    body = text[1:]
    read = Read(tmp_path, novatel_text_log(3) + text + b"*" + novatel_crc(body) + b"\r\n" + novatel_text_log(3))
    assert len(read.values("gnss", "latitude_deg")) == 6


def test_starts_without_an_end_are_followed_to_the_next_alone(tmp_path: Path) -> None:
    """Were each followed to the end of the file, or as far as a log may reach, this took minutes."""
    began = time.process_time()
    read = Read(tmp_path, novatel_text_log(3) + b"#A;" * 500_000)
    assert [(one.kind, one.count) for one in read.damages] == [("corrupt", 1_500_000)]
    assert len(read.values("gnss", "latitude_deg")) == 3 and time.process_time() - began < 20.0
