"""Every value of every topic of the recorded DataFlash logs equals that of pymavlink."""

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.base.records import RecordBatch
from groundstation.readers.dataflash import read
from groundstation.readers.source import Source
from tests.readers.dataflash_writer import flight_log
from tests.real_logs import real_log

LOGS = (
    "dataflash/erle_plane_4-12-2014_329.BIN",
    "dataflash/TestLog2_REENCODED_plane.BIN",
    "dataflash/copter_3.6.7_log0041.BIN",
    "dataflash/plane_4.2.3_pilot0004.BIN",
    "damaged/erle_tiny_no_gps.BIN",
    "damaged/pymavlink_test_truncated.BIN",
)


def by_pymavlink(path: Path) -> dict[str, list[dict[str, Any]]]:
    """Messages of a log by type, in order."""
    reader = pytest.importorskip("pymavlink.DFReader").DFReader_binary(str(path))
    found = defaultdict(list)
    with reader:
        while (message := reader.recv_msg()) is not None:
            fields = message.to_dict()
            found[fields.pop("mavpackettype")].append(fields)
    return found


def by_groundstation(path: Path) -> dict[str, dict[int, dict[str, Any]]]:
    """Records by type and place; instances of a type together again."""
    found: dict[str, dict[int, dict[str, Any]]] = defaultdict(dict)
    for batch in read(Source(path)):
        if isinstance(batch, RecordBatch) and batch.topic.startswith("raw."):
            names = list(batch.columns)
            columns = [column.values.tolist() for column in batch.columns.values()]
            rows = [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]
            found[batch.topic.split(".")[1]].update(zip(batch.record_index.tolist(), rows, strict=True))
    return found


def assert_equal(path: Path) -> None:
    theirs, ours = by_pymavlink(path), by_groundstation(path)
    assert {name: len(rows) for name, rows in theirs.items()} == {name: len(rows) for name, rows in ours.items()}
    for name, messages in theirs.items():
        rows = [row for _, row in sorted(ours[name].items())]
        for field in messages[0]:
            expected, got = [message[field] for message in messages], [row[field] for row in rows]
            if isinstance(expected[0], bytes):  # of a file that was logged: ours are its digits
                expected = [value.hex() for value in expected]
            if isinstance(expected[0], str):
                assert expected == got, (name, field)
            else:
                np.testing.assert_array_equal(np.array(expected), np.array(got), err_msg=f"{name}.{field}")
    places = sorted(place for rows in ours.values() for place in rows)
    assert places == list(range(len(places)))


@pytest.mark.real_log
@pytest.mark.parametrize("name", LOGS)
def test_recorded_log(name: str) -> None:
    assert_equal(real_log(name))


def test_hand_built_log(tmp_path: Path) -> None:
    path = tmp_path / "log.BIN"
    path.write_bytes(flight_log().content)
    assert_equal(path)
