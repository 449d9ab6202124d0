"""Plot of the estimates by segment: that farthest off is always among those shown."""

from dataclasses import replace

import pytest

from groundstation.plots.marks import Intervals
from groundstation.systems.heading.answer import TaxiSegment
from groundstation.systems.heading.plots import MOST_SEGMENTS, forest
from tests.report_example import example, heading_result

SEGMENTS = tuple(
    TaxiSegment(40.0 * place, 40.0 * place + 20.0, 20, 90.0, 9.0, 0.8 + 0.01 * (place % 3), 0.1)
    for place in range(MOST_SEGMENTS + 3)
)


@pytest.mark.parametrize("place", [0, MOST_SEGMENTS - 1, MOST_SEGMENTS + 2])
def test_the_segment_farthest_off_is_shown_and_named(place: int) -> None:
    segments = list(SEGMENTS)
    segments[place] = replace(segments[place], error_deg=0.34)
    plot = forest(example(replace(heading_result(), error_deg=0.8, segments=tuple(segments), directions=())))
    assert plot is not None
    errors = [mark.value for mark in plot.panels[0].marks if isinstance(mark, Intervals)]
    assert len(errors) == MOST_SEGMENTS + 1 and 0.34 in errors
    assert f"{MOST_SEGMENTS} of {len(segments)} segments" in plot.caption
    assert f"Farthest off by its σ: {place + 1}, " in plot.caption and "by −0.46°" in plot.caption
    names = [name for _, name in plot.panels[0].y.names]
    assert any(name.startswith(f"{place + 1}  ·") for name in names), "numbers are those of all segments"
