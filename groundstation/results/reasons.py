"""Reasons why an analysis could not run, for readers who do not know the method."""

NO_CONTACT = "no GNSS epoch with ground contact proven"
NO_GROUND_RUN = ("ground speed never above", "no straight taxi", NO_CONTACT)
WHAT_HEADING_NEEDS = (
    "The method needs a straight run on the ground at taxi speed, where the nose points along the motion, with ground "
    "contact proven; this log has none, or hardly any"
)


def explained(analysis: str, reason: str) -> str:
    """Return the reason, with the needs of the method where the aircraft did not taxi.

    Examples
    --------
    >>> explained("heading", "no INS heading in the log")
    'no INS heading in the log'
    >>> explained("heading", "no straight taxi: of 9 epochs above 6 m/s before lift-off: not proven ground 9")[:91]
    'no straight taxi: of 9 epochs above 6 m/s before lift-off: ground contact not proven for 9.'
    """
    told = in_plain_words(reason)
    return f"{told}. {WHAT_HEADING_NEEDS}" if analysis == "heading" and reason.startswith(NO_GROUND_RUN) else told


def in_plain_words(reason: str) -> str:
    """Return the reason with the names of gates in plain words.

    Examples
    --------
    >>> in_plain_words("no straight taxi: of 9 epochs above 6 m/s before lift-off: not proven ground 9")
    'no straight taxi: of 9 epochs above 6 m/s before lift-off: ground contact not proven for 9'
    """
    return reason.replace("not proven ground ", "ground contact not proven for ")
