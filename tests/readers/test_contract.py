"""One contract for every reader, and one flight written in two layouts gives equal records."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.base.records import MAX_BATCH_ROWS, Damage, Item, LogHeader, NewLog, RecordBatch, Remark
from groundstation.base.signals import field_of, is_canonical
from groundstation.readers import registry, rows
from tests.readers.test_flat_csv import Read
from tests.real_logs import real_log

FLAT = (
    "# aircraft: A\ntime_s,ins.roll_deg,ins.mode,ins.valid,gnss.track_deg,gnss.ground_speed_mps,volts,x.note\n"
    + "".join(
        f"{at}.5,{at % 7},nav,1,{at % 360},{at % 50},{at},n{at}\n" if at % 9 else f"{at}.5,,,,,,,\n"
        for at in range(400)
    )
)
G1000 = (
    '#airframe_info, airframe_name="X"\n#yyy-mm-dd, hh:mm:ss\n'
    "Lcl Date, Lcl Time, UTCOfst, HDG, MagVar, AltInd, BaroA, Fix\n"
    + "".join(
        f"2022-04-17, 12:{at // 60:02d}:{at % 60:02d}, +00:00, {at % 360}, 1.5, 100, 29.9, 3D\n" for at in range(400)
    )
)
KINDS = {"double": "f", "bool": "b", "text": "U"}


def check(items: list[Item]) -> None:
    assert isinstance(items[0], LogHeader) and items[0].reader
    assert all(isinstance(item, NewLog | RecordBatch | Damage | Remark) for item in items[1:])
    last: dict[str, int] = {}
    kinds: dict[tuple[str, str], str] = {}
    for batch in items:
        if not isinstance(batch, RecordBatch):
            continue
        assert 0 < len(batch) <= MAX_BATCH_ROWS and batch.time_ns is None
        assert is_canonical(batch.topic) or batch.topic.startswith("raw.")
        assert batch.record_index[0] > last.get(batch.topic, -1) and (np.diff(batch.record_index) > 0).all()
        last[batch.topic] = int(batch.record_index[-1])
        assert batch.device_time_ns.values.dtype == np.int64 and len(batch.device_time_ns) == len(batch)
        occupied = np.zeros(len(batch), dtype=bool)
        for name, column in batch.columns.items():
            assert len(column) == len(batch) and not column.values.flags.writeable
            assert kinds.setdefault((batch.topic, name), column.values.dtype.kind) == column.values.dtype.kind
            known = field_of(batch.topic, name)
            assert known is not None or not is_canonical(batch.topic), name
            assert known is None or column.values.dtype.kind == KINDS[known.kind]
            occupied |= column.mask
        assert occupied.all(), "a record without any sample"


def summary(items: list[Item]) -> list[str]:
    return [repr(item) for item in items]


@pytest.mark.parametrize("text", [FLAT, G1000], ids=["flat", "g1000"])
def test_hand_written_logs(tmp_path: Path, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log"
    path.write_text(text)
    whole = list(registry.read(path))
    check(whole)
    assert summary(whole) == summary(list(registry.read(path))), "reading again gives the same"
    monkeypatch.setattr(rows, "BLOCK_BYTES", 2000)
    pieces = list(registry.read(path))
    check(pieces)
    assert sum(isinstance(item, RecordBatch) for item in pieces) > 10
    others = [[item for item in items if not isinstance(item, RecordBatch)] for items in (whole, pieces)]
    assert others[0] == others[1]


@pytest.mark.real_log
@pytest.mark.parametrize(
    "name",
    [
        "g1000/log_210623_141501_TEST1.csv",
        "g1000/log_220417_125002_LFQA.csv",
        "damaged/log_220502_095923______.csv",
        "fixedwing/umn_thor_flight75.csv",
        "inertial/gv_ff02.csv",
        "ch10/kc135_429_1553_1MB.c10",
        "ch10/iliad_1553.c10",
        "damaged/bad.c10",
    ],
)
def test_recorded_logs(name: str) -> None:
    check(list(registry.read(real_log(name))))


@pytest.mark.real_log
def test_facts_of_the_recorded_flat_csvs() -> None:
    thor, gulfstream = Read(real_log("fixedwing/umn_thor_flight75.csv")), Read(real_log("inertial/gv_ff02.csv"))
    assert {topic: len(thor.rows(topic)) for topic in thor.topics} == {
        "ins": 33_573,
        "magnetometer": 6_962,
        "baro": 6_962,
        "gnss": 674,
    }
    assert thor.header.utc_of_zero_ns is None and not thor.damages and not thor.remarks
    assert len(gulfstream.rows("ins")) == 18_260 and gulfstream.header.metadata["aircraft"] == "N677F"
    assert gulfstream.header.utc_of_zero_ns == 1_401_652_872 * 10**9 and not gulfstream.damages


def test_one_flight_in_two_layouts(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    flat, other, profile = tmp_path / "flat.csv", tmp_path / "other.txt", tmp_path / "p.toml"
    lines = ["time_s,ins.true_heading_deg,ins.velocity_down_mps,ins.valid"]
    foreign = ["Recorder 5", "ms;psi;climb;ok"]
    for at in range(200):
        heading, down = rng.uniform(0, 360), rng.normal()
        lines.append(f"{at / 50:.2f},{heading:.17g},{down:.17g},1")
        foreign.append(f"{at * 20};{np.deg2rad(heading):.17g};{-down / 0.00508:.17g};true")
    flat.write_text("\n".join([*lines, ""]))
    other.write_text("\n".join([*foreign, ""]))
    profile.write_text(
        'name = "five"\n[time]\nkind = "seconds"\ncolumn = "ms"\nunit = "ms"\n[columns]\n'
        'psi = { field = "ins.true_heading_deg", unit = "rad" }\n'
        'climb = { field = "ins.velocity_down_mps", unit = "fpm", sign = -1 }\nok = { field = "ins.valid" }\n'
    )
    one, two = Read(flat), Read(other, profile)
    assert one.times("ins") == two.times("ins") and one.values("ins", "valid") == two.values("ins", "valid")
    for field in ("true_heading_deg", "velocity_down_mps"):
        assert one.values("ins", field) == pytest.approx(two.values("ins", field), rel=1e-14)
