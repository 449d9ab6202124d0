"""Role of answers that rest on stretches of the taxi, as the map of the track marks them."""

from typing import ClassVar

from groundstation.results.answer import Answers


class OnTaxi:
    """Role of an answer that rests on stretches of the taxi.

    ``taxi_serves`` says what they are used for: "the heading error".
    """

    taxi_serves: ClassVar[str]

    @property
    def taxi_used_s(self) -> tuple[tuple[float, float], ...]:
        """Ends of the stretches, flight seconds."""
        raise NotImplementedError


def on_taxi(answers: Answers) -> OnTaxi | None:
    """The first answer that rests on the taxi, None where none does."""
    return next((one for one in answers.values() if isinstance(one, OnTaxi)), None)
