"""Latency of GNSS by motion beside other ways: turns of the taxi, best trajectory."""

from groundstation.base.quantiles import NORMAL_95
from groundstation.results.agreement import Agreement, OneFinding
from groundstation.results.answer import Answers, answer_meeting, answer_of
from groundstation.results.roles import LatencyByTurns, StatesAlongTheFlight
from groundstation.systems.latency.answer import Latencies

NARROWED = 0.95  # a sigma that the turns of a taxi leave of the one known before: above it they show nothing


def latency_agreement(answers: Answers) -> Agreement | None:
    """Compare the GNSS latency behind the INS by motion and by the turns of the taxi.

    The first is the latency analysis, the second system 1. Where the former was taken out before the turns were looked
    at, it was their prior: it is taken off again.
    """
    taxi, latencies = answer_meeting(answers, LatencyByTurns), answer_of(answers, Latencies)
    found = latencies.observed(taxi.ins_topic, taxi.gnss_topic) if latencies and taxi else None
    if taxi is None or found is None or found.latency_s is None or found.confidence95_s is None:
        return None
    low, high = found.confidence95_s
    motion = OneFinding("by motion", found.latency_s, 0.5 * (high - low) / NORMAL_95)
    if taxi.time_offset_s is None or not taxi.time_offset_sigma_s or not motion.sigma > 0.0:
        return None
    offset, sigma = taxi.time_offset_s, taxi.time_offset_sigma_s
    if taxi.latency_origin == "motion":
        if sigma >= NARROWED * motion.sigma:
            return None
        information = sigma**-2 - motion.sigma**-2
        offset, sigma = offset * sigma**-2 / information, information**-0.5
    turns = OneFinding("by the turns of the taxi", (taxi.latency_used_s or 0.0) + offset, sigma)
    return Agreement(f"latency of {taxi.gnss_topic} behind {taxi.ins_topic}", "s", motion, turns)


def trajectory_agreement(answers: Answers) -> Agreement | None:
    """Compare the GNSS latency behind the INS by motion with what the best trajectory found.

    The trajectory finds both against the raw inertial data; the filter that it compared is the INS. None of a
    trajectory whose checks do not hold.
    """
    estimated, latencies = answer_meeting(answers, StatesAlongTheFlight), answer_of(answers, Latencies)
    if estimated is None or latencies is None or not estimated.is_reference:
        return None
    for row in latencies.rows:
        by_states = estimated.velocity_latency(row.reference)
        is_pair = row.quantity == "velocity" and row.other == estimated.gnss_topic and row.state == "observed"
        if by_states is None or not is_pair or row.latency_s is None or row.confidence95_s is None:
            continue
        low, high = row.confidence95_s
        motion = OneFinding("by motion", row.latency_s, 0.5 * (high - low) / NORMAL_95)
        if motion.sigma > 0.0:
            question = f"latency of {row.other} behind {row.reference}"
            return Agreement(question, "s", motion, OneFinding(estimated.by_it, *by_states))
    return None
