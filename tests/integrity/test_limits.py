"""The thresholds file: what is shipped, what a user may replace, and what is refused."""

import math
from typing import Any

import pytest

from groundstation.base.errors import SettingsError
from groundstation.base.signals import TOPICS
from groundstation.integrity.clock_steps import ClockSettings
from groundstation.integrity.counting import CountingSettings
from groundstation.integrity.limits import _FILES, SHIPPED, shipped, thresholds_from


def test_the_shipped_file_states_what_the_code_takes_without_it() -> None:
    found = shipped()
    assert (found.name, found.version) == ("default", 1)
    assert found.clock == ClockSettings() and found.counting_clock == CountingSettings()
    for kind, fields in TOPICS.items():
        ended = {field.name: (field.low, field.high) for field in fields if field.kind == "double"}
        ended = {name: ends for name, ends in ended.items() if not all(math.isinf(end) for end in ends)}
        assert found.ranges.get(kind, {}) == ended, kind


def test_the_shipped_file_holds_under_the_strict_rules_for_users() -> None:
    assert thresholds_from(_FILES.read(SHIPPED).table) == shipped()


def test_what_the_user_states_replaces_and_the_rest_stays() -> None:
    found = thresholds_from(
        {"version": 1, "name": "ours", "gaps": {"periods": 5}, "ranges": {"gnss": {"ground_speed_mps": [0, 100]}}}
    )
    assert (found.name, found.gaps.periods, found.gaps.min_s) == ("ours", 5.0, shipped().gaps.min_s)
    assert found.range_of("gnss.2", "ground_speed_mps") == (0.0, 100.0)
    assert found.range_of("gnss", "latitude_deg") == (-90.0, 90.0)
    assert found.range_of("raw.a", "x") is None
    assert found.stuck == shipped().stuck


def test_the_digest_is_of_the_values_alone() -> None:
    assert thresholds_from({"version": 1, "name": "x"}).sha256 == shipped().sha256
    assert thresholds_from({"version": 1}).name == "user" and thresholds_from({}) is shipped()
    assert thresholds_from({"version": 1, "gaps": {"min_s": 0.3}}).sha256 != shipped().sha256


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"gaps": {"periods": 3.0}}, "key version: found nothing, expected version = 1"),
        ({"version": 2}, "found 2, expected version = 1"),
        ({"version": True}, "expected version = 1"),
        ({"version": 1, "gap": {}}, "key gap"),
        ({"version": 1, "gaps": {"period": 3.0}}, "key gaps.period"),
        ({"version": 1, "gaps": 3}, "key gaps"),
        ({"version": 1, "gaps": {"periods": "3"}}, "key gaps.periods"),
        ({"version": 1, "gaps": {"periods": 0.5}}, "1 or more"),
        ({"version": 1, "rhythm": {"sporadic_topics": "event"}}, "a list"),
        ({"version": 1, "duplicates": {"share": 1.5}}, r"within \[0, 1\]"),
        ({"version": 1, "ranges": {"gps": {}}}, "key ranges.gps"),
        ({"version": 1, "ranges": {"gnss": {"valid": [0, 1]}}}, "key ranges.gnss.valid"),
        ({"version": 1, "ranges": {"gnss": {"gdop": [3]}}}, "lowest, highest"),
        ({"version": 1, "ranges": {"gnss": {"gdop": [3, 1]}}}, "less than"),
        ({"version": 1, "ranges": {"gnss": {"gdop": [math.nan, 1]}}}, "less than"),
        ({"version": 1, "clock": {"stray_rows": -1}}, "key clock.stray_rows"),
    ],
)
def test_a_mistake_is_named(table: dict[str, Any], says: str) -> None:
    with pytest.raises(SettingsError, match=says) as caught:
        thresholds_from(table, "mine.toml")
    assert "mine.toml" in str(caught.value)
