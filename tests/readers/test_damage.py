"""Damaged flat CSVs: what is sound is read, what is not is counted, and nothing but GroundstationError escapes."""

import random
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import GroundstationError
from groundstation.base.records import Damage, Item, LogHeader, RecordBatch
from groundstation.integrity import corrected, ledger_findings, survey
from groundstation.readers import registry, rows

HEADER = "time_s,ins.roll_deg,ins.true_heading_deg,ins.mode,gnss.latitude_deg,x"
ROWS = [f"{row}.25,{row}.5,{row * 10}.125,nav,55.{row},{row}" for row in range(20)]
SOUND = ("# aircraft: A\n" + "\n".join([HEADER, *ROWS]) + "\n").encode()
SEEDS = range(60)


def read(path: Path) -> list[Item]:
    """Items of a log; the whole chain up to the findings must hold on whatever comes."""
    items = list(registry.read(path))
    assert isinstance(items[0], LogHeader)
    found = survey(items)
    assert all("\n" not in finding.text for finding in ledger_findings(found.ledger))
    reached: dict[str, int] = {}
    for batch in corrected(items, found.clock):
        assert batch.time_ns is not None and (np.diff(batch.time_ns) >= 0).all()
        assert batch.time_ns[0] >= reached.get(batch.topic, 0), "times go back or are negative"
        reached[batch.topic] = int(batch.time_ns[-1])
    return items


def ins_rows(items: list[Item]) -> dict[int, tuple[float, ...]]:
    """Row number -> roll and heading."""
    found = {}
    for batch in items:
        if isinstance(batch, RecordBatch) and batch.topic == "ins":
            columns = [batch.columns[name] for name in ("roll_deg", "true_heading_deg")]
            for at, row in enumerate(batch.record_index):
                found[int(row)] = tuple(
                    float(column.values[at]) if column.mask[at] else float("nan") for column in columns
                )
    return found


def write(tmp_path: Path, content: bytes) -> Path:
    path = tmp_path / "log.csv"
    path.write_bytes(content)
    return path


def expected(row: int) -> tuple[float, float]:
    return row + 0.5, (row * 10 + 0.125) % 360


def test_the_sound_file_is_read_whole(tmp_path: Path) -> None:
    items = read(write(tmp_path, SOUND))
    assert ins_rows(items) == {row + 3: expected(row) for row in range(20)}
    assert not [item for item in items if isinstance(item, Damage)]


@pytest.mark.parametrize("every", [5, pytest.param(1, marks=pytest.mark.slow)])
def test_cut_at_every_byte(tmp_path: Path, every: int) -> None:
    header_end = SOUND.index(b"\n", SOUND.index(HEADER.encode())) + 1
    for size in range(0, len(SOUND), every):
        path = write(tmp_path, SOUND[:size])
        if size < header_end:
            try:
                items = read(path)
            except GroundstationError:
                continue  # nothing of a flat CSV is left in so short a piece
            assert not ins_rows(items)
            continue
        items = read(path)
        whole = SOUND[header_end:size].count(b"\n")
        found = ins_rows(items)
        assert len(found) in (whole, whole + 1), size
        assert all(found[row + 3] == expected(row) for row in range(whole)), size
        partial = not SOUND[:size].endswith(b"\n")
        lost = [item for item in items if isinstance(item, Damage) and item.kind == "truncated"]
        assert bool(lost) == (partial and len(found) == whole), size


@pytest.mark.parametrize("seed", SEEDS)
def test_flipped_bits_cost_only_what_they_hit(tmp_path: Path, seed: int) -> None:
    rng = random.Random(seed)
    content = bytearray(SOUND)
    first = content.index(b"\n", content.index(HEADER.encode())) + 1
    hit_rows = set()
    for _ in range(4):
        at = rng.randrange(first, len(content))
        hit_rows.add(SOUND[:at].count(b"\n") - 2)
        hit_rows |= {SOUND[:at].count(b"\n") - 1} if SOUND[at] == 10 else set()  # a lost line end joins two rows
        content[at] ^= 1 << rng.randrange(8)
    items = read(write(tmp_path, bytes(content)))
    values = list(ins_rows(items).values())
    for row in set(range(20)) - hit_rows:
        assert expected(row) in values, f"row {row} was not hit"
    assert len(values) <= 20 + 4


@pytest.mark.parametrize("seed", SEEDS)
def test_flipped_bits_anywhere_and_random_bytes(tmp_path: Path, seed: int) -> None:
    rng = random.Random(1000 + seed)
    content = bytearray(SOUND)
    for _ in range(rng.choice((1, 5, 50))):
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    noise = bytes(rng.randrange(256) for _ in range(rng.choice((1, 10, 3000))))
    for name, damaged in (("flips", bytes(content)), ("noise", noise), ("both", SOUND + noise + SOUND)):
        try:
            items = read(write(tmp_path, damaged))
        except GroundstationError as error:
            assert name != "both" and "\n" not in str(error)
        else:
            assert name != "both" or len(ins_rows(items)) >= 38


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (HEADER.encode(), {}),
        (HEADER.encode() + b"\n", {}),
        (HEADER.encode() + b"\n\n\n", {}),
        (HEADER.encode() + b"\n" + ROWS[3].encode() + b"\n", {2: expected(3)}),
        (HEADER.encode() + b"\n1,nan,nan,,,\n", {2: (float("nan"), float("nan"))}),
    ],
)
def test_next_to_nothing(tmp_path: Path, content: bytes, found: dict[int, tuple[float, float]]) -> None:
    assert np.array_equal(list(ins_rows(read(write(tmp_path, content))).values()), list(found.values()), equal_nan=True)


def test_a_file_that_ends_in_its_header_says_so(tmp_path: Path) -> None:
    (damage,) = [item for item in read(write(tmp_path, HEADER.encode())) if isinstance(item, Damage)]
    assert damage.kind == "truncated" and damage.loses_data


def test_nul_bytes_and_broken_utf8_cost_their_cell(tmp_path: Path) -> None:
    content = HEADER.encode() + b"\n1,2,3,na\0v,5,6\n2,\xff2,3,nav,5,6\n3,2\0,3,nav,5,6\n4,2,3,n\rav,5,6\n"
    items = read(write(tmp_path, content))
    rolls = [values[0] for values in ins_rows(items).values()]
    assert np.array_equal(rolls, [2, np.nan, np.nan, 2], equal_nan=True)
    counts = {item.place.partition(",")[0]: item.count for item in items if isinstance(item, Damage)}
    assert counts == {"ins.mode": 2, "ins.roll_deg": 2}


def test_a_minus_that_became_a_carriage_return_is_no_plus(tmp_path: Path) -> None:
    items = read(write(tmp_path, HEADER.encode() + b"\n1,\r12,3,nav,5,6\n"))
    assert np.isnan(ins_rows(items)[2][0])


def test_a_huge_line_is_dropped_and_the_rest_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rows, "MAX_LINE_BYTES", 1 << 20)
    monkeypatch.setattr(rows, "BLOCK_BYTES", 1 << 16)
    lines = [HEADER, ROWS[0], "9" * (3 << 20), ROWS[1], ROWS[2]]
    items = read(write(tmp_path, "\n".join([*lines, ""]).encode()))
    assert list(ins_rows(items)) == [2, 4, 5]
    (damage,) = [item for item in items if isinstance(item, Damage)]
    assert damage.kind == "dropped_rows" and damage.place == "row 3"


@pytest.mark.parametrize("size", [3, 100_000])
def test_padding_with_nul_bytes_or_the_end_mark_of_dos(
    tmp_path: Path, size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rows, "MAX_LINE_BYTES", 1 << 12)
    monkeypatch.setattr(rows, "BLOCK_BYTES", 1 << 10)
    for padding in (bytes(size), b"\x1a"):
        items = read(write(tmp_path, SOUND + padding))
        assert len(ins_rows(items)) == 20 and not [item for item in items if isinstance(item, Damage)]


def test_ten_thousand_columns(tmp_path: Path) -> None:
    names = [f"x.c{column}" for column in range(10_000)]
    content = ",".join(["time_s", *names]) + "\n" + "".join(f"{row}" + ",1" * 10_000 + "\n" for row in range(3))
    items = read(write(tmp_path, content.encode()))
    (batch,) = [item for item in items if isinstance(item, RecordBatch)]
    assert batch.topic == "raw.x" and len(batch) == 3 and len(batch.columns) == 10_000


def test_shuffled_rows_are_sorted(tmp_path: Path) -> None:
    lines = [f"{row},{row},0,nav,1,1" for row in range(500)]
    random.Random(5).shuffle(lines)
    items = list(registry.read(write(tmp_path, "\n".join([HEADER, *lines, ""]).encode())))
    found = survey(items)
    assert found.clock.is_unordered and not found.clock.steps and found.ledger["ins"].coverage == 1.0
    rolls = np.concatenate([b.columns["roll_deg"].values for b in corrected(items, found.clock) if b.topic == "ins"])
    assert np.array_equal(rolls, np.arange(500.0))


def test_a_missing_channel_is_simply_absent(tmp_path: Path) -> None:
    items = read(write(tmp_path, b"time_s,ins.roll_deg,gnss.latitude_deg\n1,2,\n2,3,\n"))
    assert {item.topic for item in items if isinstance(item, RecordBatch)} == {"ins"}


def test_quotes_from_flipped_bits_do_not_swallow_rows(tmp_path: Path) -> None:
    content = SOUND.replace(b"\n7.25,7.5", b'\n"7.25,7.5').replace(b"12.5,120", b'12.5,"120')
    found = ins_rows(read(write(tmp_path, content)))
    assert len(found) == 20 and found[10] == expected(7) and np.isnan(found[15][1])
