"""Read a log: an overview, then block by block every record, raw and canonical."""

import re
from collections import Counter
from collections.abc import Iterator

import numpy as np

from groundstation.base.records import MAX_BATCH_ROWS, Damage, Item, LogHeader, NewLog, RecordBatch
from groundstation.readers.dataflash.blocks import RecordBlock, Scanner
from groundstation.readers.dataflash.canonical import Mapper
from groundstation.readers.dataflash.choices import choose
from groundstation.readers.dataflash.definitions import RecordDefinition
from groundstation.readers.dataflash.doubts import doubts, odd_instances
from groundstation.readers.dataflash.facts import metadata, utc_of_power_up, utc_readings
from groundstation.readers.dataflash.overview import DataflashOverview, overview
from groundstation.readers.dataflash.values import RecordRows, by_instance, rows_of
from groundstation.readers.source import Source

READER = "dataflash"


def items(source: Source) -> Iterator[Item]:
    """Yield the header, batches in the order of the blocks of the file, remarks and damage."""
    scanner = Scanner(source)
    found = overview(scanner)
    facts = metadata(found)
    firmware = facts.get("firmware", "")
    utc_ns, remarks = utc_of_power_up(found.gps_times, firmware)
    readings = utc_readings(found.gps_times, firmware)
    yield LogHeader(READER, facts, utc_ns, has_counting_clock=True, utc_readings=readings)
    yield from map(NewLog, scanner.log_starts)
    choices = choose(found, facts.get("vehicle", ""))
    mapper, topics = Mapper(found, choices), _Topics()
    unreadable: dict[str, int] = {}
    by_type, by_topic = Counter[int](), Counter[str]()
    for block in scanner.again():
        for rows in _rows(block, found):
            topic = topics.of(rows)
            by_type[rows.definition.type_id] += len(rows)
            by_topic[topic] += len(rows)
            if rows.definition.time_field is not None:
                absent = 0 if rows.time_ns.present is None else int(np.count_nonzero(~rows.time_ns.present))
                unreadable[topic] = unreadable.get(topic, 0) + absent
            yield from _batches(topic, rows)
            mapper.take(rows)
        yield from mapper.batches()
    yield from remarks
    yield from choices.remarks(found, mapper.fields)
    yield from mapper.remarks()
    yield from found.damages
    yield from mapper.damages()
    yield from doubts(scanner.payloads, scanner.definitions, by_type)
    yield from odd_instances(by_topic)
    for topic, count in unreadable.items():
        if count:
            yield Damage("unreadable_cells", topic, count, "times that no clock writes", topic)


def _rows(block: RecordBlock, found: DataflashOverview) -> Iterator[RecordRows]:
    """Rows of each type, and of each instance where the type tells them apart."""
    for definition, which in block.groups():
        if not definition.fields:
            continue
        rows = rows_of(definition, block.records(definition, which), block.first_index + which)
        name = found.units.instance_field(definition)
        if name is None or (definition.type_id, definition.name) not in found.split:
            yield rows
        else:
            yield from by_instance(rows, name)


def _batches(topic: str, rows: RecordRows) -> Iterator[RecordBatch]:
    columns = rows.columns()
    batch = RecordBatch(topic, rows.record_index, rows.time_ns, columns)
    for start in range(0, len(batch), MAX_BATCH_ROWS):
        yield batch.take(slice(start, start + MAX_BATCH_ROWS)) if len(batch) > MAX_BATCH_ROWS else batch


class _Topics:
    """Names of the raw topics: one layout, one topic.

    A type that takes another's name gets its id added.
    """

    def __init__(self) -> None:
        self._layouts: dict[str, tuple[int, object]] = {}

    def of(self, rows: RecordRows) -> str:
        """Return ``raw.<type>`` or ``raw.<type>.<instance>``."""
        name = self._name(rows.definition)
        return f"raw.{name}" if rows.instance is None else f"raw.{name}.{rows.instance}"

    def _name(self, definition: RecordDefinition) -> str:
        layout = (definition.type_id, definition.fields)
        name, copy = definition.name, 1
        while self._layouts.setdefault(name, layout) != layout:
            copy += 1
            base = re.sub(r"_$", "", definition.name)
            name = f"{base}_{definition.type_id}" if copy == 2 else f"{base}_{definition.type_id}_{copy}"
        return name
