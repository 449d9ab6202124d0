"""Guard over all readers: a canonical number that comes from one raw field is that field times one fixed factor.

Logs of every format, recorded and written here, whole and with bytes changed, hold the table of ``logged_facts``: where
a record has both the raw value and the canonical one, they agree. Presence is other tests' matter.
"""

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from groundstation.base.errors import GroundstationError
from groundstation.base.records import RecordBatch
from groundstation.base.signals import RAW_PREFIX, field_of, kind_of
from groundstation.readers import registry
from groundstation.readers.icd import shipped
from tests.readers import chapter10_packets as made
from tests.readers.logged_facts import ARINC_429, BAGS, DATAFLASH, G1000, HDF5, NMEA, POS, TLOG, UBX, ULOG, Fact
from tests.readers.logs_of_every_format import RNG_SEED, WRITTEN
from tests.readers.test_g1000 import row as g1000_row
from tests.readers.test_g1000 import write as write_g1000
from tests.real_logs import REAL_LOGS, real_log

ROUNDING = 1e-9  # relative: two factors that are multiplied in another order
ANGLE_DEG = 1e-7


@dataclass(frozen=True, eq=False)
class Table:
    """Batches of one topic in one: places, and values and presence of each column."""

    places: np.ndarray
    columns: Mapping[str, tuple[np.ndarray, np.ndarray]]


def tables(path: Path, **options: object) -> dict[str, Table]:
    """Topics of a log. A column that some batches lack is absent there."""
    batches: dict[str, list[RecordBatch]] = {}
    for item in registry.read(path, **options):
        if isinstance(item, RecordBatch):
            batches.setdefault(item.topic, []).append(item)
    found = {}
    for topic, parts in batches.items():
        numbers = {name for part in parts for name, column in part.columns.items() if column.values.dtype.kind in "iuf"}
        columns = {}
        for name in numbers:
            have = [part.columns.get(name) for part in parts]
            lengths = [len(part) for part in parts]
            values = [np.zeros(n, np.int8) if one is None else one.values for one, n in zip(have, lengths, strict=True)]
            known = [np.zeros(n, bool) if one is None else one.mask for one, n in zip(have, lengths, strict=True)]
            if all(part.dtype.kind in "iuf" for part in values):
                columns[name] = np.concatenate(values), np.concatenate(known)
        found[topic] = Table(np.concatenate([part.record_index for part in parts]), columns)
    return found


def joined(fact: Fact, raw: Table, row: Table, leaders: list[Table]) -> tuple[np.ndarray, np.ndarray]:
    """Which rows of a raw table and of a canonical one are of the same record, or share the fact's column."""
    if not fact.shared:
        _places, of_raw, of_row = np.intersect1d(raw.places, row.places, return_indices=True)
        return of_raw, of_row
    pairs: list[tuple[np.ndarray, np.ndarray]] = []
    keys, known = raw.columns[fact.shared]
    _keys, first, counts = np.unique(keys, return_index=True, return_counts=True)
    first = first[(counts == 1) & known[first]]  # of several records with one key nobody knows which is meant
    for leader in leaders:
        _places, at, of_row = np.intersect1d(leader.places, row.places, return_indices=True)
        values, has = leader.columns[fact.shared]
        values, of_row = values[at][has[at]], of_row[has[at]]
        _values, one, counts = np.unique(values, return_index=True, return_counts=True)
        values, of_row = values[one[counts == 1]], of_row[one[counts == 1]]
        _shared, of_raw, at = np.intersect1d(keys[first], values, return_indices=True)
        pairs.append((first[of_raw], of_row[at]))
    return tuple(np.concatenate([pair[side] for pair in pairs]) for side in (0, 1)) if pairs else (first[:0], first[:0])


def compared(found: Mapping[str, Table], table: list[Fact]) -> set[str]:
    """Hold the table against a log; the fields that had values to compare."""
    seen: set[str] = set()
    for fact in table:
        told = {
            topic: one for topic, one in found.items() if re.fullmatch(fact.raw, topic) and fact.column in one.columns
        }
        if fact.shared and (len(told) > 1 or not all(fact.shared in one.columns for one in told.values())):
            continue  # several talkers tell it
        for topic, raw in told.items():
            leaders = [one for name, one in found.items() if name.startswith(RAW_PREFIX) and fact.shared in one.columns]
            for canonical, row in found.items():
                if kind_of(canonical) == fact.kind and fact.field in row.columns:
                    of_raw, of_row = joined(fact, raw, row, leaders)
                    if agree(fact, raw, row, of_raw, of_row, f"{topic}.{fact.column} -> {canonical}.{fact.field}"):
                        seen.add(f"{fact.kind}.{fact.field}")
    return seen


def agree(fact: Fact, raw: Table, row: Table, of_raw: np.ndarray, of_row: np.ndarray, where: str) -> int:
    """Assert that values that are on both sides agree; how many are."""
    (logged, is_logged), (values, is_there) = raw.columns[fact.column], row.columns[fact.field]
    both = is_logged[of_raw] & is_there[of_row]
    is_integer = logged.dtype.kind in "iu"
    with np.errstate(invalid="ignore", over="ignore"):
        logged = logged[of_raw][both].astype(np.float64)
        values = values[of_row][both][logged < fact.below] if np.isfinite(fact.below) else values[of_row][both]
        logged = logged[logged < fact.below] if np.isfinite(fact.below) else logged
        factor = fact.factor if fact.of_integers is None or not is_integer else fact.of_integers
        same_as(values, logged * factor, fact.kind, fact.field, where)
    return len(logged)


def same_as(values: np.ndarray, expected: np.ndarray, kind: str, field: str, where: str) -> None:
    known = field_of(kind, field)
    assert known is not None, where
    if known.is_heading:
        finite = np.isfinite(expected) & (np.abs(expected) < 1e6)
        apart = (values[finite] - expected[finite] + 180.0) % 360.0 - 180.0
        assert np.all(np.abs(apart) <= ANGLE_DEG), where
        assert np.all((values[finite] >= 0.0) & (values[finite] < 360.0)), where
    else:
        np.testing.assert_allclose(values, expected, rtol=ROUNDING, atol=1e-12, err_msg=where)


MUTATED = tuple(name for name in WRITTEN if name != "hdf5")  # h5py, not we, answers for its bytes


def in_both(found: Mapping[str, Table], table: list[Fact]) -> set[str]:
    """Fields whose raw column a log has."""
    return {
        f"{fact.kind}.{fact.field}"
        for fact in table
        for topic, one in found.items()
        if re.fullmatch(fact.raw, topic) and fact.column in one.columns
    }


@pytest.mark.parametrize("form", WRITTEN)
def test_values_of_a_written_log(tmp_path: Path, form: str) -> None:
    name, write, table, missing = WRITTEN[form]
    write(tmp_path / name)
    found = tables(tmp_path / name)
    assert compared(found, table) == in_both(found, table) - missing


@cache
def written(form: str, folder: Path) -> tuple[bytes, int]:
    name, write, _table, _missing = WRITTEN[form]
    first = write(folder / name)
    return (folder / name).read_bytes(), first


@pytest.mark.parametrize("form", MUTATED)
@settings(derandomize=True, max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(changes=st.lists(st.tuples(st.floats(0.0, 1.0), st.integers(1, 255)), min_size=1, max_size=12))
def test_values_of_a_log_with_changed_bytes(
    tmp_path_factory: pytest.TempPathFactory, form: str, changes: list[tuple[float, int]]
) -> None:
    """Definitions stay as they are; whatever is read of the rest agrees with itself."""
    folder = tmp_path_factory.getbasetemp()
    content, first = written(form, folder)
    changed = bytearray(content)
    for place, bits in changes:
        changed[first + int(place * (len(content) - first - 1))] ^= bits
    name, _write, table, _missing = WRITTEN[form]
    path = folder / f"changed_{name}" if form != "sbet" else folder / "sbet_20240507.out"
    path.write_bytes(changed)
    try:
        found = tables(path)
    except GroundstationError:  # refused by name: other tests hold that
        return
    compared(found, table)


RECORDED: Mapping[str, tuple[list[Fact], tuple[str, ...]]] = {
    "dataflash": (DATAFLASH, ("dataflash/*.BIN", "damaged/*.BIN", "cases/d*.bin")),
    "ulog": (ULOG, ("ulog/*.ulg", "damaged/*appended*.ulg", "cases/u*.ulg")),
    "tlog": (TLOG, ("tlog/*.tlog",)),
    "ubx": (UBX, ("gnss/*.ubx", "gnss/pygpsdata-*.log", "cases/*.ubx")),
    "nmea": (NMEA, ("gnss/*.nmea", "gnss/pynmeagps*.log", "gnss/pygpsdata-*.log", "cases/n*.nmea")),
    "bag": (BAGS, ("foreign/*.mcap", "foreign/*.bag", "cases/m*.mcap")),
    "pos": (POS, ("gnss/*.pos", "cases/p*.pos")),
    "hdf5": (HDF5, ("approach/*.hdf5",)),
}


@pytest.mark.real_log
@pytest.mark.parametrize("form", RECORDED)
def test_values_of_recorded_logs(form: str) -> None:
    table, patterns = RECORDED[form]
    paths = sorted(path for pattern in patterns for path in REAL_LOGS.glob(pattern))
    if not paths:
        pytest.skip(f"no recorded log of {form} is here (GROUNDSTATION_REAL_LOGS)")
    seen: set[str] = set()
    for path in paths:
        try:
            found = tables(path)
        except GroundstationError:  # nothing of it can be read: other tests hold that
            continue
        seen |= compared(found, table)
    assert seen, "nothing to compare"


def assert_file_agrees(path: Path, columns: Mapping[str, tuple[int, float]], delimiter: str = ",") -> int:
    """Hold the rows of a table of text against what is read of them; how many fields had values."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    rows = [line.split() if delimiter == " " else next(csv.reader([line]), []) for line in lines]
    found, seen = tables(path), 0
    for target, (at, factor) in columns.items():
        topic, _, field = target.rpartition(".")
        if topic in found and field in found[topic].columns:
            values, known = found[topic].columns[field]
            logged = [float(rows[line - 1][at]) for line in found[topic].places[known].tolist()]
            same_as(values[known], np.array(logged) * factor, topic, field, f"column {at} -> {target}")
            seen += len(logged) > 0
    return seen


def by_name(path: Path, names: Mapping[str, tuple[str, float]]) -> dict[str, tuple[int, float]]:
    """Columns of a G1000 file by the names in its header."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    labels = next(line for line in lines if "Latitude" in line and "Longitude" in line).split(",")
    places = {label.strip(): at for at, label in enumerate(labels)}
    return {target: (places[name], factor) for target, (name, factor) in names.items() if name in places}


def test_values_of_a_table_by_profile(tmp_path: Path) -> None:
    path = write_g1000(tmp_path, *(g1000_row(f"12:49:{second:02d}") for second in range(10, 30)))
    assert assert_file_agrees(path, by_name(path, G1000)) >= 6


@pytest.mark.real_log
@pytest.mark.parametrize("name", ["log_220417_125002_LFQA.csv", "log_220502_135932_EGPN.csv"])
def test_values_of_a_recorded_table_by_profile(name: str) -> None:
    path = real_log(f"g1000/{name}")
    assert assert_file_agrees(path, by_name(path, G1000)) >= 10


def test_values_of_a_flat_table(tmp_path: Path) -> None:
    """Its columns have the canonical names: factor 1."""
    names = ("gnss.latitude_deg", "gnss.hdop", "gnss.satellites_used", "ins.roll_deg", "ins.true_heading_deg")
    rng, path = np.random.default_rng(RNG_SEED), tmp_path / "flat.csv"
    rows = (",".join(f"{value:.7f}" for value in (at / 10, *rng.uniform(0.1, 89.0, len(names)))) for at in range(30))
    path.write_text("\n".join((f"time_s,{','.join(names)}", *rows, "")))
    columns = {name: (at, 1.0) for at, name in enumerate(names, start=1)}
    assert assert_file_agrees(path, columns) == len(names)


def test_values_of_bus_words(tmp_path: Path) -> None:
    """A word is an integer in two's complement; the standard gives the value of its highest bit below the sign."""
    rng, words = np.random.default_rng(RNG_SEED), []
    for _sample in range(50):
        for label, (_field, bits, _highest, _factor) in ARINC_429.items():
            words.append((1, 200_000, made.word_429(label, int(rng.integers(0, 1 << bits)) << (19 - bits))))
    path = tmp_path / "words"
    path.write_bytes(made.packet(4, 0x38, made.words_429(words), 0))
    found = tables(path, icds=(shipped("arinc429_inertial"),))
    (raw,) = (one for topic, one in found.items() if topic.startswith("raw.bus.429"))
    word, _known = raw.columns["word"]
    seen = set()
    for label, (field, bits, highest, factor) in ARINC_429.items():
        is_label = np.array([int(f"{one & 0xFF:08b}"[::-1], 2) == label for one in word.tolist()])
        number = (word[is_label].astype(np.int64) >> (29 - bits)) & ((1 << bits) - 1)
        number = np.where(number >> (bits - 1), number - (1 << bits), number)
        expected = number * (highest / 2.0 ** (bits - 2)) * factor
        values, known = found["ins"].columns[field]
        _places, of_raw, of_row = np.intersect1d(raw.places[is_label], found["ins"].places[known], return_indices=True)
        same_as(values[known][of_row], expected[of_raw], "ins", field, f"label {label:o}")
        seen |= {field} if len(of_raw) else set()
    assert seen, "no row of ins stands at a word of its own"
