"""The pair of INS and GNSS that shows the motion of an aircraft on the ground."""

from groundstation.base.errors import NotAssessableError
from groundstation.base.records import HEADING_IS_TRACK
from groundstation.tables.sources import sources_of_kind, why_without_gnss
from groundstation.tables.table import Flight


def choose_pair(flight: Flight, ins_topic: str = "", gnss_topic: str = "") -> tuple[str, str]:
    """Return the INS and GNSS topics to use.

    They are the ones asked for, else the first that have what is needed.

    Raises
    ------
    NotAssessableError
        When there is no pair.
    """
    with_heading = [
        topic
        for field in ("true_heading_deg", "magnetic_heading_deg")
        for topic in sources_of_kind(flight, "ins")
        if flight[topic].has(field)
    ]
    independent = [topic for topic in with_heading if not _is_track(flight, topic)]
    ins = ins_topic or next(iter(independent or with_heading), "")
    velocities = ("velocity_north_mps", "velocity_east_mps")
    gnss = gnss_topic or next(
        (topic for topic in sources_of_kind(flight, "gnss") if flight[topic].has(*velocities)), ""
    )
    if ins not in flight:
        raise NotAssessableError("heading", f"no topic {ins}" if ins else "no INS heading in the log")
    if gnss not in flight:
        raise NotAssessableError("heading", f"no topic {gnss}" if gnss else why_without_gnss(flight, "velocity"))
    if _is_track(flight, ins):
        text = f"the heading of {ins} is the receiver's own track: their difference is zero whatever the nose does"
        raise NotAssessableError("heading", text)
    return ins, gnss


def _is_track(flight: Flight, topic: str) -> bool:
    """Tell whether the topic's heading is a receiver's own track.

    A track does not measure where the nose points.
    """
    return f"{HEADING_IS_TRACK}.{topic}.true_heading_deg" in flight.metadata
