"""ICD as the text of a DTS file.

:func:`groundstation.readers.icd.load.load` reads it back unchanged.
"""

import re
from collections.abc import Iterable, Mapping

from groundstation.readers.icd.load import MESSAGES, SUPPLEMENTS, WORDS, usual_status
from groundstation.readers.icd.model import Element, Element429, Element1553, Icd, Message1553, Word429
from groundstation.readers.icd.signals import by_name
from groundstation.readers.icd.words_1553 import WORDS_OF

NONE = "none"
PLAIN = re.compile(r"(?!(?i:null|true|false|yes|no|on|off)$)[A-Za-z_][A-Za-z0-9_.-]*")


def to_yaml(icd: Icd, comments: Mapping[str, str] | None = None, head: Iterable[str] = ()) -> str:
    """The ICD as YAML, a line for each element.

    Parameters
    ----------
    icd : Icd
    comments : mapping, optional
        Comment above a word or message, by its name.
    head : iterable of str
        Lines of comment on top.
    """
    told = comments or {}
    lines = [f"# {line}" for line in head]
    if icd.messages_1553:
        lines.append(f"{MESSAGES}:")
        for message in icd.messages_1553:
            lines += _message(message, told.get(message.name, ""))
        lines.append(f"{SUPPLEMENTS[0]}: {{}}")
    if icd.words_429:
        lines.append(f"{WORDS}:")
        for word in icd.words_429:
            lines += _word(word, told.get(word.name, ""))
        lines.append(f"{SUPPLEMENTS[1]}: {{}}")
    return "\n".join(lines) + "\n"


def _message(message: Message1553, comment: str) -> Iterable[str]:
    sides = (message.transmit, message.receive)
    names = ", ".join(_text(name) for name in (*message.equipment, NONE, NONE)[:2])
    facts = [
        f"command: [{message.transmit}, {message.receive}]",
        f"lru_addr: [{', '.join(str(side >> 11) for side in sides)}]",
        f"lru_subaddr: [{', '.join(str(side >> 5 & 31) for side in sides)}]",
        f"lru_name: [{names}]",
        f"bus: {_text(message.bus)}",
        *([] if message.channel is None else [f"channel: {message.channel}"]),
        f"wrdcnt: {message.word_count}",
        f"rate: {message.rate_hz!r}",
        "mode_code: False",
        "desc: ''",
    ]
    yield from _comment(comment)
    yield f"  {_text(message.name)}:"
    yield f"    msg_data: {{{', '.join(facts)}}}"
    for key, is_word in (("word_elem", True), ("bit_elem", False)):
        chosen = [one for one in message.elements if (one.schema in WORDS_OF) == is_word]
        yield f"    {key}:" if chosen else f"    {key}: {{}}"
        for one in chosen:
            yield f"      {_text(one.name)}: {{{', '.join(_facts_1553(one, (message.name, *message.equipment)))}}}"


def _word(word: Word429, comment: str) -> Iterable[str]:
    facts = [
        f"label: {word.label:03o}",
        f"bus: {_text(word.bus)}",
        *([] if word.channel is None else [f"channel: {word.channel}"]),
        *([] if word.subchannel is None else [f"subchannel: {word.subchannel}"]),
        f"sdi: {word.sdi}",
        f"rate: {word.rate_hz!r}",
        "desc: ''",
        f"lru_name: {_text(word.equipment)}",
    ]
    yield from _comment(comment)
    yield f"  {_text(word.name)}:"
    yield f"    wrd_data: {{{', '.join(facts)}}}"
    yield "    elem:" if word.elements else "    elem: {}"
    for one in word.elements:
        yield f"      {_text(one.name)}: {{{', '.join(_facts_429(one, (word.name, word.equipment)))}}}"


def _comment(text: str) -> list[str]:
    return [f"  # {text}"] if text else []


def _facts_429(one: Element429, holders: tuple[str, ...]) -> list[str]:
    facts = [f"schema: {one.schema}", f"msbval: {one.msbval!r}", f"lsb: {one.lsb}", f"bitcnt: {one.bit_count}"]
    own = [] if one.status == usual_status(one.schema, one.unit) else [f"status: {one.status}"]
    own += [] if one.step == 1.0 else [f"step: {one.step!r}"]
    own += [f"fine_of: {_text(one.fine_of)}"] if one.fine_of else []
    return [*facts, *_common(one, holders), *own]


def _facts_1553(one: Element1553, holders: tuple[str, ...]) -> list[str]:
    facts = [f"offset: {one.offset}", f"cnt: {one.count}", f"schema: {one.schema}", f"msbval: {one.msbval!r}"]
    bits = [] if one.schema in WORDS_OF else _bits(one)
    validity = [] if one.valid_if is None else [f"valid_if: {_text(one.valid_if.name)}"]
    return [*facts, *bits, "multifmt: False", *_common(one, holders), *validity]


def _bits(one: Element1553) -> list[str]:
    count = 16 * (one.count - 1) + one.lsb - one.msb + 1
    return [f"msb: {one.msb}", f"lsb: {one.lsb}", f"bitcnt: {count}"]


def _common(one: Element, holders: tuple[str, ...]) -> list[str]:
    facts = [f"desc: {_text(one.description)}", f"uom: {_text(one.unit)}", "class: 0"]
    if isinstance(one, Element429) and one.fine_of:
        return facts
    if one.signal is None:  # said aloud where the name alone would make it one
        return facts if by_name(one, holders).signal is None else [*facts, "signal: ''"]
    if one.is_by_name:
        return facts
    facts += [f"signal: {one.signal}"] + ([f"transform: {one.transform}"] if one.transform else [])
    return [*facts, "sign: -1"] if one.factor < 0.0 else facts


def _text(text: str) -> str:
    """Return a text for a flow mapping, in quotes where it is no plain word."""
    return text if PLAIN.fullmatch(text) else "'" + " ".join(text.split()).replace("'", "''") + "'"
