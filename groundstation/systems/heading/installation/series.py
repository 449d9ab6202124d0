"""Flights by installation, and the learned answer of each from earlier ones alone."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from groundstation.base.dataclasses import dataclass
from groundstation.results.installations import Installation, InstalledFlight, Lesson, Pooled
from groundstation.systems.heading.installation.answer import InstallationResult
from groundstation.systems.heading.installation.model import Belief, doubts, first_belief, installed, learn
from groundstation.systems.heading.installation.outcome import alone_answer, learned_answer, named
from groundstation.systems.heading.installation.settings import POOLED_SIGMA, InstallationSettings

SAME_TIME = "another flight of this serial begins at the same time"
FIRST = "no earlier flight of this serial in this aircraft taught anything"


@dataclass(frozen=True)
class UnitFlights:
    """The flights of one unit in one aircraft until it flies in another one, in order of time."""

    ins_serial: str
    aircraft: str
    lessons: tuple[Lesson, ...]


def series_of(lessons: Iterable[Lesson]) -> tuple[UnitFlights, ...]:
    """Lessons by installation; those without serial, aircraft or UTC are in none.

    A unit that flies in another aircraft begins anew there, and anew when it comes back. Flights of one serial that
    begin at the same time do not teach.
    """
    by_serial: dict[str, list[Lesson]] = defaultdict(list)
    for one in lessons:
        if one.ins_serial and one.aircraft and one.start_utc:
            by_serial[one.ins_serial].append(one)
    found: list[UnitFlights] = []
    for serial in sorted(by_serial):
        ordered = sorted(by_serial[serial], key=lambda one: one.place)
        times = Counter(one.start_utc for one in ordered)
        stretch: list[Lesson] = []
        for one in ordered:
            if times[one.start_utc] > 1:
                one = replace(one, not_taught=one.not_taught or SAME_TIME)
            if stretch and stretch[-1].aircraft != one.aircraft:
                found.append(UnitFlights(serial, stretch[-1].aircraft, tuple(stretch)))
                stretch = []
            stretch.append(one)
        found.append(UnitFlights(serial, stretch[-1].aircraft, tuple(stretch)))
    return tuple(found)


def answers_of(
    series: UnitFlights, settings: InstallationSettings
) -> Iterator[tuple[Lesson, InstallationResult | None]]:
    """Every flight with its learned answer; None where there is no heading error to improve."""
    return _answered(series, _Teacher(settings))


def _answered(series: UnitFlights, teacher: "_Teacher") -> Iterator[tuple[Lesson, InstallationResult | None]]:
    """Flights with their answers; the teacher then has been taught by all of them."""
    for lesson in series.lessons:  # of those that begin at one time none teaches
        yield lesson, teacher.answer(lesson)
        teacher.teach(lesson)


def answer_from(lesson: Lesson, earlier: Sequence[Lesson], settings: InstallationSettings) -> InstallationResult:
    """Return the learned answer of a flight with a taxi.

    It is from the earlier flights of its unit in its aircraft; later ones are left out.
    """
    if lesson.number_deg is None or not (lesson.ins_serial and lesson.aircraft and lesson.start_utc):
        return alone_answer(lesson, lesson.not_taught)
    others = [one for one in earlier if one.place[0] < lesson.place[0] and one.flight_id != lesson.flight_id]
    same = next(one for one in series_of([*others, lesson]) if lesson in one.lessons)
    teacher = _Teacher(settings)
    for one in same.lessons[: same.lessons.index(lesson)]:
        teacher.teach(one)
    return teacher.answer(lesson) or alone_answer(lesson, lesson.not_taught)


def installation_of(series: UnitFlights, settings: InstallationSettings) -> Installation:
    """Return an installation with the answer of each flight, and the outlook for the next one."""
    teacher = _Teacher(settings)
    flights = tuple(InstalledFlight(*one) for one in _answered(series, teacher))
    belief = teacher.belief
    odd, changed = ((), ()) if belief is None else (tuple(one.tolist()) for one in doubts(belief))
    return Installation(
        ins_serial=series.ins_serial,
        aircraft=series.aircraft,
        installed=None if belief is None else installed(belief),
        taught_by=teacher.taught_by,
        odd=odd,
        changed=changed,
        flights=flights,
        pooled=pooled_of(series, settings),
    )


def pooled_of(series: UnitFlights, settings: InstallationSettings) -> tuple[Pooled, ...]:
    """Return figures of other sensors from all flights of an installation.

    They follow the rule of the mounting. Each is a mounting that every flight sees as a reference does: changes and odd
    flights are doubted alike.
    """
    found = []
    for name, sigma in POOLED_SIGMA.items():
        flights = [
            (
                lesson.flight_id,
                Lesson("", "", "", "", mounting_sigma_deg=sigma, reference_deg=value, reference_sigma_deg=own),
            )
            for lesson in series.lessons
            if lesson.not_taught != SAME_TIME
            for value, own in ((one.value, one.sigma) for one in lesson.measured if one.name == name)
        ]
        if not flights:
            continue
        belief = first_belief(flights[0][1], settings)
        for _flight_id, one in flights:
            belief = learn(belief, one, settings)
        names, (odd, changed), believed = [one for one, _ in flights], doubts(belief), installed(belief)
        found.append(
            Pooled(
                name,
                len(flights),
                believed.mounting_deg,
                believed.mounting_sigma_deg,
                named(names, odd.tolist(), settings),
                named(names, changed.tolist(), settings),
            )
        )
    return tuple(found)


class _Teacher:
    """Belief as flights are added, made anew where the prior is another.

    The prior is that of class and stated sigmas.
    """

    def __init__(self, settings: InstallationSettings) -> None:
        self.settings = settings
        self.belief: Belief | None = None
        self._taught: list[Lesson] = []
        self._prior: tuple[float, ...] = ()

    @property
    def taught_by(self) -> tuple[str, ...]:
        return tuple(one.flight_id for one in self._taught)

    def teach(self, one: Lesson) -> None:
        if one.teaches and one.number_deg is not None:
            self._taught.append(one)
            if self.belief is None or self._prior != one.prior:
                self._relearn(one)
            else:
                self.belief = learn(self.belief, one, self.settings)

    def answer(self, lesson: Lesson) -> InstallationResult | None:
        if lesson.number_deg is None or lesson.error_deg is None:
            return None
        if self.belief is None:
            return alone_answer(lesson, FIRST)
        if self._prior != lesson.prior:
            self._relearn(lesson)
        return learned_answer(lesson, self.belief, self.taught_by, self.settings)

    def _relearn(self, lesson: Lesson) -> None:
        self._prior, self.belief = lesson.prior, first_belief(lesson, self.settings)
        for one in self._taught:
            self.belief = learn(self.belief, one, self.settings)
