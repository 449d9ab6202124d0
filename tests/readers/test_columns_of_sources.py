"""Columns of one topic from several sources: in the order of the log, each row with the fields of its source alone."""

import numpy as np

from groundstation.base.records import Column, frozen
from groundstation.readers.parts import TopicPart, bounded, merged, occupied


def part(index: list[int], validity: list[int] | None = None, **columns: Column) -> TopicPart:
    places = np.array(index)
    return TopicPart(places, Column(places * 10), columns, None if validity is None else np.array(validity))


def test_rows_of_several_parts_stand_in_order_with_the_fields_of_their_own() -> None:
    first = part([0, 3, 4], name=Column(np.array(["a", "b", "c"])), speed=Column(np.array([1.0, 2.0, np.nan])))
    second = part([1, 7], [11, 71], speed=Column(np.array([8, 9]), np.array([True, False])))
    batch = merged("ins", [first, second])
    assert batch.record_index.tolist() == [0, 1, 3, 4, 7]
    assert batch.device_time_ns.values.tolist() == [0, 10, 30, 40, 70] and batch.device_time_ns.mask.all()
    assert batch.validity_time_ns is not None and batch.validity_time_ns.tolist() == [0, 11, 30, 40, 71]
    name, speed = batch.columns["name"], batch.columns["speed"]
    assert name.mask.tolist() == [True, False, True, True, False] and name.values[name.mask].tolist() == ["a", "b", "c"]
    assert speed.mask.tolist() == [True, True, True, True, False]  # a NaN of the source is a value
    assert np.array_equal(speed.values[speed.mask], [1.0, 8.0, 2.0, np.nan], equal_nan=True)


def test_a_part_without_rows_changes_nothing() -> None:
    empty = part([], speed=Column(np.zeros(0, np.int64)), name=Column(np.zeros(0, "U3")))
    batch = merged("ins", [empty, part([2, 5], speed=Column(np.array([1, 2])))])
    assert batch.columns["speed"].values.tolist() == [1, 2] and not batch.columns["name"].mask.any()
    assert list(bounded(merged("ins", [empty]))) == []


def test_rows_without_any_value_are_left_out_and_masks_that_were_one_stay_one() -> None:
    mask, other = frozen(np.array([True, False, False])), np.array([False, False, True])
    of_one = {name: Column(np.arange(3.0), mask) for name in "ab"}
    kept = occupied(part([0, 1, 2], [5, 6, 7], **of_one, c=Column(np.arange(3), other)))
    assert kept is not None and kept.index.tolist() == [0, 2] and kept.time.values.tolist() == [0, 20]
    assert kept.validity_ns is not None and kept.validity_ns.tolist() == [5, 7]
    assert kept.columns["a"].present is kept.columns["b"].present
    assert kept.columns["c"].mask.tolist() == [False, True]
    batch = merged("gnss", [kept, part([1], a=Column(np.ones(1)), b=Column(np.ones(1)))])
    assert batch.columns["a"].present is batch.columns["b"].present
    assert batch.columns["a"].mask.tolist() == [True, True, False]
    assert occupied(part([0], a=Column(np.ones(1), np.zeros(1, bool)))) is None and occupied(part([0])) is None
