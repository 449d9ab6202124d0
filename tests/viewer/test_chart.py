"""Charts of one number against another: what is drawn in the box stands where the axes say."""

from pathlib import Path

import numpy as np
import pytest
import rerun as rr

from groundstation.viewer import colours
from groundstation.viewer.chart import BAND_COLUMNS, WIDTH, Chart, ChartAxis
from groundstation.viewer.recorder import Recorder
from tests.recording_contents import Contents


def test_a_band_fills_between_its_edges_and_not_across_a_gap(tmp_path: Path) -> None:
    x = np.arange(11.0)
    low, high = np.where(x == 6.0, np.nan, 0.1 * x), np.full(11, 5.0)  # the upper edge leaves the box
    with rr.RecordingStream("chart") as stream:
        stream.save(tmp_path / "a.rrd")
        chart = Chart(
            Recorder(stream, 0, has_utc=False), "chart", ChartAxis("x", 0.0, 10.0), ChartAxis("y", 0.0, 2.0), 100.0
        )
        chart.band("band", x, low, high, colours.GREEN)
        stream.disconnect()
    (batch,) = Contents(tmp_path / "a.rrd").fixed["/chart/band"]
    strips = np.array(batch.column("LineStrips2D:strips").to_pylist()[0])
    at = strips[:, 0, 0] / WIDTH * 10.0
    assert (strips[:, 0, 0] == strips[:, 1, 0]).all() and len(strips) < BAND_COLUMNS
    assert not ((at > 5.0 + 1e-6) & (at < 7.0 - 1e-6)).any()
    assert strips[:, 0, 1] == pytest.approx(100.0 * (1.0 - 0.1 * at / 2.0), abs=1e-3)
    assert strips[:, 1, 1] == pytest.approx(np.zeros(len(strips)), abs=1e-6)
