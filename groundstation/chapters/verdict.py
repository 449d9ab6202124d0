"""Verdicts as pages mark them."""

from collections.abc import Mapping

from groundstation.chapters.parts import Mark

VERDICTS: Mapping[str, Mark] = {
    "accept": Mark("good", "Accept"),
    "advisory": Mark("warn", "Advisory"),
    "reject": Mark("bad", "Reject"),
    "extend": Mark("warn", "Extend"),
    "undecided": Mark("unknown", "Undecided"),
}
NOT_ASSESSABLE = Mark("unknown", "Not assessable")
