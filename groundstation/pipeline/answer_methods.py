"""Answers of a flight or a session in Python: a method for each, typed for editors."""

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, overload

from groundstation.base.errors import NotAssessableError, UnknownNameError
from groundstation.results.answer import A, Answer, PlanAnswer, SessionAnswer
from groundstation.results.flight import FlightResults

if TYPE_CHECKING:
    from groundstation.systems.cooperative.answer import CooperativeResult
    from groundstation.systems.gnss.answer import GnssReception
    from groundstation.systems.heading.answer import HeadingResult
    from groundstation.systems.heading.installation.answer import InstallationResult
    from groundstation.systems.health.answer import AutopilotHealth
    from groundstation.systems.inertial.alignment_answer import GroundResult
    from groundstation.systems.inertial.answer import InertialResult
    from groundstation.systems.inertial.cause_answer import CausesResult
    from groundstation.systems.inertial.forecast_answer import ForecastResult
    from groundstation.systems.inertial.units_answer import UnitsResult
    from groundstation.systems.landing.answer import LandingResult
    from groundstation.systems.landing.beacons.answer import BeaconLanding
    from groundstation.systems.latency.answer import Latencies
    from groundstation.systems.magnetic.answer import MagneticResult
    from groundstation.systems.magnetic.flux_answer import FluxDeviation
    from groundstation.systems.magnetic.ground_answer import GroundDeviation
    from groundstation.systems.reference.answer import ReferenceResult
    from groundstation.systems.several_logs.answer import Together
    from groundstation.systems.trajectory.answer import BestTrajectory


class AnswerMethods(ABC):
    """A method for each answer, named as the system's folder or as the analysis.

    Each returns one answer or raises NotAssessableError: its message says why the data do not allow it. The types are
    imported when they are asked for: a log is opened without.
    """

    @property
    @abstractmethod
    def results(self) -> FlightResults:
        """Answers of all analyses, as frozen dataclasses."""

    def heading(self) -> "HeadingResult":
        """Return the heading error and correction in degrees (system 1).

        Raises
        ------
        NotAssessableError
            When the data does not allow it; the message says why.
        """
        from groundstation.systems.heading.answer import HeadingResult

        return self.answer(HeadingResult)

    def installation(self) -> "InstallationResult":
        """Return the heading error in degrees with what earlier flights taught of the mounting.

        It needs ``open(..., installation=)``. Raises as :meth:`heading`.
        """
        from groundstation.systems.heading.installation.answer import InstallationResult

        return self.answer(InstallationResult)

    def inertial(self) -> "InertialResult":
        """Return the errors of the INS: nmi/h, m/s, deg and deg/h (system 2).

        Raises as :meth:`heading`.
        """
        from groundstation.systems.inertial.answer import InertialResult

        return self.answer(InertialResult)

    def ins_causes(self) -> "CausesResult":
        """Return the errors of the INS by cause, m/s and nmi/h; raises as :meth:`heading`."""
        from groundstation.systems.inertial.cause_answer import CausesResult

        return self.answer(CausesResult)

    def forecast(self) -> "ForecastResult":
        """Return how far the INS can be trusted without GNSS: metres by minutes.

        Raises as :meth:`heading`.
        """
        from groundstation.systems.inertial.forecast_answer import ForecastResult

        return self.answer(ForecastResult)

    def ins_units(self) -> "UnitsResult":
        """Return several INS of one flight compared: nmi/h, m/s, m; raises as :meth:`heading`."""
        from groundstation.systems.inertial.units_answer import UnitsResult

        return self.answer(UnitsResult)

    def ins_ground(self) -> "GroundResult":
        """Return alignment, drift at rest and shutdown of the INS: s, m/s, m.

        Raises as :meth:`heading`.
        """
        from groundstation.systems.inertial.alignment_answer import GroundResult

        return self.answer(GroundResult)

    def latency(self) -> "Latencies":
        """Return how much later than the INS each sensor shows the motion, seconds.

        Raises as :meth:`heading`.
        """
        from groundstation.systems.latency.answer import Latencies

        return self.answer(Latencies)

    def trajectory(self) -> "BestTrajectory":
        """Return the best trajectory: state, accuracy in m, m/s and deg, checks.

        The errors of the on-board filter are in it; ``states()`` has the trajectory itself. Raises as :meth:`heading`.
        """
        from groundstation.systems.trajectory.answer import BestTrajectory

        return self.answer(BestTrajectory)

    def magnetic(self) -> "MagneticResult":
        """Return the deviation of the magnetic heading in degrees (system 3).

        Raises as :meth:`heading`.
        """
        from groundstation.systems.magnetic.answer import MagneticResult

        return self.answer(MagneticResult)

    def magnetic_ground(self) -> "GroundDeviation":
        """Return the error in degrees of the installed heading sensor on straight ground runs.

        Raises as :meth:`heading`.
        """
        from groundstation.systems.magnetic.ground_answer import GroundDeviation

        return self.answer(GroundDeviation)

    def magnetic_flux(self) -> "FluxDeviation":
        """Return the deviation in degrees of a compass that gives heading alone, in flight.

        Raises as :meth:`heading`.
        """
        from groundstation.systems.magnetic.flux_answer import FluxDeviation

        return self.answer(FluxDeviation)

    def landing(self) -> "LandingResult":
        """Return approaches, touchdowns and criteria: m, m/s, deg, flight seconds.

        ``to_frame("criteria")`` and ``to_frame("events")`` are frames of all approaches. Raises as :meth:`heading`.
        """
        from groundstation.systems.landing.answer import LandingResult

        return self.answer(LandingResult)

    def landing_beacons(self) -> "BeaconLanding":
        """Return the approach by locators: deviations in metres; raises as :meth:`heading`."""
        from groundstation.systems.landing.beacons.answer import BeaconLanding

        return self.answer(BeaconLanding)

    def health(self) -> "AutopilotHealth":
        """Return the health of the autopilot: verdict of each check, each measure with its unit.

        Raises as :meth:`heading`.
        """
        from groundstation.systems.health.answer import AutopilotHealth

        return self.answer(AutopilotHealth)

    def gnss(self) -> "GnssReception":
        """Return the GNSS reception: states in seconds, scatter and jumps in metres.

        Raises as :meth:`heading`.
        """
        from groundstation.systems.gnss.answer import GnssReception

        return self.answer(GnssReception)

    def reference(self) -> "ReferenceResult":
        """Return the errors against a reference: m, m/s and deg, with the accuracy claimed.

        It needs ``open(..., reference=)`` or a truth in the log. Raises as :meth:`heading`.
        """
        from groundstation.systems.reference.answer import ReferenceResult

        return self.answer(ReferenceResult)

    def several_logs(self) -> "Together":
        """Return how several logs of one flight were joined: offsets in s, drift in ppm.

        ``groundstation run --together`` makes such a flight. Raises as :meth:`heading`.
        """
        from groundstation.systems.several_logs.answer import Together

        return self.answer(Together)

    def cooperative(self) -> "CooperativeResult":
        """Return the navigation between aircraft: errors in metres by algorithm and aircraft.

        ``groundstation cooperative`` makes the session folder to open. Raises as :meth:`heading`.
        """
        from groundstation.systems.cooperative.answer import CooperativeResult

        return self.answer(CooperativeResult)

    @overload
    def answer(self, kind: type[A]) -> A: ...
    @overload
    def answer(self, kind: str) -> Answer: ...
    def answer(self, kind: type[A] | str) -> A | Answer:
        """Return the answer of any analysis, by its type or its name; units are in the names.

        Parameters
        ----------
        kind : type of Answer, or str
            The name of an analysis as ``groundstation list`` has it, or of a system with one analysis. This way the
            answer of a plug-in is had.

        Raises
        ------
        NotAssessableError
            When the data does not allow it; the message says why.
        UnknownNameError
            When there is no analysis of that name.
        """
        asked = _type_of(kind) if isinstance(kind, str) else kind
        found = self.results.answer(asked)
        if found is not None:
            return found
        raise NotAssessableError(asked.analysis, *_reason(self.results, asked))


def _type_of(name: str) -> type[Answer]:
    """Return the type of an answer by the name of its analysis, or of its system."""
    from groundstation.systems import systems

    known = dict(systems().answer_types)
    for system in systems().every:
        own = (*system.analyses, *system.session_analyses)
        if own:
            known.setdefault(system.name, own[0].answer)
    if name not in known:
        raise UnknownNameError("answers", name, known)
    return known[name]


def _reason(results: FlightResults, kind: type[Answer]) -> tuple[str, str]:
    """Return why there is no answer of a type: what was found, what was expected."""
    from groundstation.systems import systems

    analyses = (*systems().analyses, *systems().session_analyses)
    analysis = next((one for one in analyses if one.answer is kind), None)
    required = () if analysis is None else analysis.requires
    reasons = results.reasons(kind.analysis) or results.reasons(*required)
    if reasons:
        return reasons[0], ""
    if issubclass(kind, SessionAnswer) and not results.is_session:
        return "one flight", "the folder of a session of several aircraft (groundstation cooperative)"
    if issubclass(kind, PlanAnswer) and not results.is_plan:
        return "a flight", "the folder of a plan (groundstation plan)"
    if results.is_session and not issubclass(kind, SessionAnswer):
        return "a session of several aircraft", "the folder of one flight"
    return ("no answer", analysis.needs) if analysis is not None else ("the log does not hold what it needs", "")
