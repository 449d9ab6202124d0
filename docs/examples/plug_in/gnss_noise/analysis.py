"""The GNSS noise as an analysis: every standstill long enough, and the speed shown in it."""

from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np
from gnss_noise.answer import GnssNoise, Standing
from gnss_noise.settings import GnssNoiseSettings

from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.base.signals import topics_of_kind
from groundstation.results.answer import Answers, answer_of
from groundstation.results.columns import AnswerColumn
from groundstation.results.figures import FigureData
from groundstation.systems.analysis import Analysis, Found
from groundstation.systems.known import Known

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

VELOCITY = ("velocity_north_mps", "velocity_east_mps")


def _run(flight: "Flight", known: Known, settings: GnssNoiseSettings) -> Found[GnssNoise]:
    topics = topics_of_kind("gnss", [topic for topic in flight.topics() if flight[topic].has(*VELOCITY)])
    if not topics:
        raise NotAssessableError("gnss_noise", "no GNSS velocity in the log")
    time_s, table = flight.time_s(topics[0]), flight[topics[0]]
    speed_mps = np.hypot(*(table.values(name) for name in VELOCITY))
    standstills, is_standing = [], np.zeros(len(table), dtype=bool)
    for phase in known.phases.intervals:
        start_s, end_s = phase.start_s + settings.guard_s, phase.end_s - settings.guard_s
        inside = (time_s >= start_s) & (time_s <= end_s) & np.isfinite(speed_mps)
        if phase.phase == "standstill" and end_s - start_s >= settings.standstill_min_s and inside.any():
            rms_mps = float(np.sqrt(np.mean(speed_mps[inside] ** 2)))
            standstills.append(Standing(start_s, end_s, int(inside.sum()), rms_mps))
            is_standing |= inside
    if not standstills:
        raise NotAssessableError("gnss_noise", f"no standstill of {settings.standstill_min_s:g} s with GNSS velocity")
    longest = max(standstills, key=lambda one: one.end_s - one.start_s)
    shown = {"time_s": time_s, "speed_mps": np.where(is_standing, speed_mps, np.nan)}
    answer = GnssNoise(
        topics[0],
        longest.start_s,
        longest.end_s,
        longest.samples,
        longest.speed_rms_mps,
        tuple(standstills),
        asdict(settings),
        (FigureData("gnss_noise_speed", shown, {"time_s": 3, "speed_mps": 4}),),
    )
    text = f"speed of {topics[0]} at standstill: {longest.speed_rms_mps:.3f} m/s RMS"
    return Found(answer, (Finding("info", "gnss_noise.found", text, topics[0]),))


def _sentence(answers: Answers) -> str:
    answer = answer_of(answers, GnssNoise)
    return "" if answer is None else f"GNSS shows {answer.speed_rms_mps:.3f} m/s RMS at standstill"


GNSS_NOISE = Analysis(
    name="gnss_noise",
    title="speed that GNSS shows at standstill: the noise of its velocity",
    subject="GNSS noise",
    needs="gnss velocities, and a standstill",
    settings=GnssNoiseSettings,
    answer=GnssNoise,
    run=_run,
    sentence=_sentence,
    columns=(
        AnswerColumn("gnss_noise_start_s", "number", "start of the longest standstill", lambda answer: answer.start_s),
        AnswerColumn("gnss_noise_speed_rms_mps", "number", "speed shown in it", lambda answer: answer.speed_rms_mps),
    ),
)
