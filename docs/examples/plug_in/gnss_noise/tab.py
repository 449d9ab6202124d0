"""GNSS noise: the speed that GNSS shows at standstill, and what its chapter says."""

import numpy as np
import rerun.blueprint as rrb

from groundstation.chapters.by_answer import chapter_of
from groundstation.chapters.markdown import markdown
from groundstation.results.figures import numbers
from groundstation.results.flight import FlightResults
from groundstation.viewer import colours
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.views import document, plot


def gnss_noise(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None where the flight has no such answer."""
    answer, figure = results.answers.get("gnss_noise"), results.figure_with_rows("gnss_noise_speed")
    if answer is None or figure is None:
        return None
    speed_mps = numbers(figure, "speed_mps")
    standing = np.isfinite(speed_mps)
    time_ns = recorder.time_ns(numbers(figure, "time_s")[standing])
    recorder.dots("gnss_noise/speed", time_ns, speed_mps[standing], Line("speed at standstill, m/s", colours.SAMPLES))
    recorder.document("gnss_noise/answer", markdown(chapter_of(results, answer, recorder.systems.chapters)))
    views = [
        plot("Speed of GNSS at standstill, m/s", "gnss_noise/speed"),
        document("What was found", "gnss_noise/answer"),
    ]
    return rrb.Horizontal(contents=views, column_shares=[3.0, 2.0], name="GNSS noise")
