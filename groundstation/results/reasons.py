"""Reasons why an analysis could not run, for readers who do not know the method."""

NO_CONTACT = "no GNSS epoch with ground contact proven"


def in_plain_words(reason: str) -> str:
    """Return the reason with the names of gates in plain words.

    Examples
    --------
    >>> in_plain_words("no straight taxi: of 9 epochs above 6 m/s before lift-off: not proven ground 9")
    'no straight taxi: of 9 epochs above 6 m/s before lift-off: ground contact not proven for 9'
    """
    return reason.replace("not proven ground ", "ground contact not proven for ")
