"""Base of the answers of a plan, which tell of something that has not been flown."""

from groundstation.results.answer import Answer


class PlanAnswer(Answer):
    """Base of the answers of ``groundstation plan``."""
