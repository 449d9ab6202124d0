"""Chapters by the answers they present, in the order of the report."""

from collections.abc import Iterable

from groundstation.base.failures import attempt
from groundstation.chapters.chapter import Chapter
from groundstation.chapters.cooperative import cooperative, is_session
from groundstation.chapters.forecast import forecast
from groundstation.chapters.generic import generic
from groundstation.chapters.heading import heading
from groundstation.chapters.inertial import inertial
from groundstation.chapters.installation import installation
from groundstation.chapters.landing import landing
from groundstation.chapters.landing_beacons import landing_beacons
from groundstation.chapters.latency import latency
from groundstation.chapters.magnetic import magnetic
from groundstation.chapters.parts import Rank, Section
from groundstation.chapters.plan import PLAN_CHAPTERS, is_plan
from groundstation.chapters.reference import reference
from groundstation.chapters.together import together
from groundstation.results.answer import Answer
from groundstation.results.cooperative import CooperativeResult
from groundstation.results.flight import FlightResults
from groundstation.results.forecast import ForecastResult
from groundstation.results.heading import HeadingResult
from groundstation.results.inertial import InertialResult
from groundstation.results.installation import InstallationResult
from groundstation.results.landing import LandingResult
from groundstation.results.landing_beacons import BeaconLanding
from groundstation.results.latency import Latencies
from groundstation.results.magnetic import MagneticResult
from groundstation.results.magnetic_ground import GroundDeviation
from groundstation.results.reference import ReferenceResult
from groundstation.results.together import Together

# In the order of the report. An answer that none of them tells has the generic chapter.
FLIGHT_CHAPTERS: tuple[Chapter, ...] = (
    Chapter((InstallationResult,), installation),
    Chapter((HeadingResult,), heading),
    Chapter((InertialResult,), inertial),
    Chapter((ForecastResult,), forecast),
    Chapter((Latencies,), latency),
    Chapter((MagneticResult, GroundDeviation), magnetic),
    Chapter((LandingResult,), landing),
    Chapter((BeaconLanding,), landing_beacons),
    Chapter((Together,), together),
    Chapter((ReferenceResult,), reference),
)
SESSION_CHAPTERS: tuple[Chapter, ...] = (Chapter((CooperativeResult,), cooperative),)


def answer_chapters(results: FlightResults) -> tuple[Section, ...]:
    """Return the chapters of a flight with an answer, best first: the order of a report."""
    listed = [chapter for chapter in FLIGHT_CHAPTERS if any(map(results.answer, chapter.answers))]
    every = (section for section in (*_built(listed, results), *_generic(results)) if section is not None)
    return tuple(sorted(every, key=lambda one: Rank.OTHER if one.claim is None else one.claim.rank))


def chapters_of(results: FlightResults) -> tuple[Section, ...]:
    """Return the chapters on the answers of a flight, a session or a plan.

    First those written for an answer, then a generic one for each other answer. A chapter of a flight without its
    answer says why there is none.
    """
    listed = PLAN_CHAPTERS if is_plan(results) else SESSION_CHAPTERS if is_session(results) else FLIGHT_CHAPTERS
    return tuple(section for section in (*_built(listed, results), *_generic(results)) if section is not None)


def _built(chapters: Iterable[Chapter], results: FlightResults) -> tuple[Section | None, ...]:
    """Return chapters with something to say; one that fails is left out."""
    return tuple(attempt("chapter", one.name, one.build, results) for one in chapters)


def _generic(results: FlightResults) -> tuple[Section | None, ...]:
    """Return the generic chapters of answers that have none of their own."""
    return tuple(attempt("chapter", one.analysis, generic, results, one) for one in without_chapter(results))


def chapter_of(results: FlightResults, answer: Answer) -> Section:
    """Return the chapter on an answer: its own, else the generic one."""
    own = (one.build(results) for one in (*FLIGHT_CHAPTERS, *SESSION_CHAPTERS) if isinstance(answer, one.answers))
    return next((section for section in own if section is not None), None) or generic(results, answer)


def without_chapter(results: FlightResults) -> tuple[Answer, ...]:
    """Return the answers that have no chapter of their own."""
    told = tuple(kind for chapter in (*FLIGHT_CHAPTERS, *SESSION_CHAPTERS, *PLAN_CHAPTERS) for kind in chapter.answers)
    return tuple(answer for answer in results.answers.values() if not isinstance(answer, told))
