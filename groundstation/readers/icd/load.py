"""Read an ICD: a DTS file in YAML for 1553 messages, ARINC 429 words or both.

The error of a mistake names the file, word and key. We add these keys: ``channel`` and ``subchannel`` of a word or
message; ``signal``, ``sign``, ``transform``, ``status``, ``step``, ``fine_of`` and ``valid_if`` of an element.
docs/chapter10.md describes them.
"""

from collections.abc import Callable, Mapping
from dataclasses import field, replace
from pathlib import Path
from typing import Any, NoReturn, TypeVar, cast, get_args

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.signals import kind_of
from groundstation.readers.icd.instances import numbered
from groundstation.readers.icd.model import (
    Element429,
    Element1553,
    Icd,
    Message1553,
    Status,
    Transform,
    Word429,
)
from groundstation.readers.icd.signals import by_name, canonical_factor, is_count, unit_of
from groundstation.readers.icd.words_1553 import WORDS_OF
from groundstation.readers.icd.yaml_text import Value, kind_of_value, read_yaml

SHIPPED = Path(__file__).parent / "shipped"
MESSAGES, WORDS = "translatable_message_definitions", "translatable_word_definitions"
SUPPLEMENTS = ("supplemental_bus_map_command_words", "supplemental_bus_map_labels")
COMMAND_KEYS = ("command", "lru_addr", "lru_subaddr", "lru_name", "bus", "wrdcnt", "rate", "mode_code", "desc")
WORD_KEYS = ("label", "bus", "sdi", "rate", "desc", "lru_name")
ELEMENT_KEYS = ("schema", "msbval", "desc", "uom", "class", "multifmt")
OWN_KEYS = ("signal", "sign", "transform")
BITS = ("UNSIGNEDBITS", "SIGNEDBITS", "ASCII")
STATUS_OF: Mapping[str, Status] = {"SIGNEDBITS": "bnr", "SIGNMAG": "bnr", "BCD": "bcd", "ASCII": "none"}
AnyElement = TypeVar("AnyElement", Element429, Element1553)


def load(path: Path) -> Icd:
    """Read and check an ICD.

    Elements whose ``signal`` is not stated feed the one that their name and unit make plain, if any. Where several
    messages or buses feed the same signal, each is a unit of its own: ``ins.1``, ``ins.2`` in the order of the file.

    Raises
    ------
    SettingsError
        In one line, with the file, the word and the key: not YAML, no definitions, a key missing, a wrong kind, an
        unknown schema, bits or words outside the message, an unknown signal, a unit of another kind ...
    """
    table = read_yaml(path)
    checker = _Checker(path.name)
    if not any(table.get(key) for key in (MESSAGES, WORDS)):
        checker.fail("", "no definitions", f"{MESSAGES} or {WORDS}")
    messages = checker.named(table.get(MESSAGES), MESSAGES, checker.message)
    words = checker.named(table.get(WORDS), WORDS, checker.word)
    checker.fine(words)
    checker.known(table, "", (MESSAGES, WORDS, *SUPPLEMENTS))
    return Icd(path.stem, *numbered(words, messages), checker.told())


def shipped_names() -> tuple[str, ...]:
    """Names of the ICDs that come with the package, in alphabetical order."""
    return tuple(sorted(path.stem for path in SHIPPED.glob("*.yaml")))


def shipped(name: str) -> Icd:
    """An ICD that comes with the package.

    Raises
    ------
    SettingsError
        For an unknown name.

    Examples
    --------
    >>> [word.name for word in shipped("arinc429_inertial").words_429 if word.label == 0o314]
    ['true_heading']
    """
    if name not in shipped_names():
        raise SettingsError("ICD", repr(name), f"one of {', '.join(shipped_names())}, or a file *.yaml")
    return load(SHIPPED / f"{name}.yaml")


def usual_status(schema: str, unit: str) -> Status:
    """Return the reading of the sign/status matrix of an element that does not state it.

    Bits without a unit are discrete.
    """
    return STATUS_OF.get(schema, "bnr" if unit else "discrete")


def named_icd(name: str) -> Icd:
    """The ICD of a file, or a shipped one by its name.

    Raises
    ------
    SettingsError
        As :func:`load`, and for a name that is neither.
    """
    path = Path(name)
    return load(path) if path.suffix or path.is_file() else shipped(name)


@dataclass
class _Checker:
    """Parser of the mappings into words and messages.

    Every error names the file, the word and the key.
    """

    where: str
    unknown: dict[str, int] = field(default_factory=dict)

    def fail(self, key: str, found: str, expected: str = "") -> NoReturn:
        place = f"{self.where}, {key}" if key else self.where
        raise SettingsError(place, found, expected, "see docs/chapter10.md")

    def told(self) -> tuple[str, ...]:
        """Return one note for each unknown key."""
        return tuple(f"{self.where}: key {key!r} is not known, {count} times" for key, count in self.unknown.items())

    def known(self, table: Mapping[str, Value], _place: str, keys: tuple[str, ...]) -> None:
        for key in table:
            if key not in keys:
                self.unknown[key] = self.unknown.get(key, 0) + 1

    def table(self, value: Value, place: str) -> dict[str, Value]:
        if not isinstance(value, dict):
            self.fail(place, kind_of_value(value), "a mapping")
        return value

    def named(self, value: Value, place: str, make: Callable[[str, str, dict[str, Value]], Any]) -> tuple[Any, ...]:
        """Return the results of ``make`` for every named entry; empty without entries."""
        if value is None:
            return ()
        entries = self.table(value, place)
        return tuple(make(name, name, self.table(entry, name)) for name, entry in entries.items())

    def needed(self, table: Mapping[str, Value], key: str, place: str) -> Value:
        if table.get(key) is None:
            self.fail(f"{place}: {key}", "nothing", "a value")
        return table[key]

    def text(self, table: Mapping[str, Value], key: str, place: str) -> str:
        value = table.get(key)
        if value is not None and not isinstance(value, str):
            self.fail(f"{place}: {key}", kind_of_value(value), "a text")
        return value or ""

    def integer(self, value: Value, place: str, low: int, high: int, base: int = 10) -> int:
        digits = value.strip() if isinstance(value, str) else ""
        try:
            number = int(digits, base)
        except ValueError:
            number = high + 1
        if not low <= number <= high:
            expected = f"{low} to {high}" if base == 10 else f"{low:o} to {high:o}, octal"
            self.fail(place, kind_of_value(value), expected)
        return number

    def number(self, value: Value, place: str) -> float:
        try:
            number = float(value) if isinstance(value, str) else float("nan")
        except ValueError:
            number = float("nan")
        if abs(number) > 1e30 or number != number:
            self.fail(place, kind_of_value(value), "a number")
        return number

    def optional(self, table: Mapping[str, Value], key: str, place: str, low: int, high: int) -> int | None:
        value = table.get(key)
        return None if value is None else self.integer(value, f"{place}: {key}", low, high)

    def choice(self, table: Mapping[str, Value], key: str, place: str, allowed: tuple[str, ...]) -> str:
        value = self.needed(table, key, place)
        if value not in allowed:
            self.fail(f"{place}: {key}", kind_of_value(value), f"one of {', '.join(allowed)}")
        return str(value)

    def pair(self, table: Mapping[str, Value], key: str, place: str, high: int) -> tuple[int, int]:
        value = self.needed(table, key, place)
        if not isinstance(value, list) or len(value) != 2:
            self.fail(f"{place}: {key}", kind_of_value(value), "two numbers: [transmit, receive]")
        first, second = (self.integer(one, f"{place}: {key}", 0, high) for one in value)
        return first, second

    def message(self, name: str, place: str, table: dict[str, Value]) -> Message1553:
        self.known(table, place, ("msg_data", "word_elem", "bit_elem"))
        data = self.table(self.needed(table, "msg_data", place), f"{place}: msg_data")
        self.known(data, place, (*COMMAND_KEYS, "channel"))
        commands = self.pair(data, "command", place, 0xFFFF)
        is_mode_code = self.text(data, "mode_code", place).lower() == "true"
        count = self.integer(self.needed(data, "wrdcnt", place), f"{place}: wrdcnt", 0 if is_mode_code else 1, 32)
        self.addresses(data, commands, is_mode_code, count, place)
        names = data.get("lru_name")
        message = Message1553(
            name,
            *commands,
            bus=self.text(data, "bus", place),
            channel=self.optional(data, "channel", place, 0, 0xFFFF),
            word_count=count,
            rate_hz=self.number(self.needed(data, "rate", place), f"{place}: rate"),
            equipment=tuple(one for one in names if isinstance(one, str)) if isinstance(names, list) else (),
        )
        bits = self.elements(table.get("bit_elem"), name, "bit_elem", message, self.bit_element)
        words = self.elements(table.get("word_elem"), name, "word_elem", message, self.word_element)
        return replace(message, elements=self.with_validity(words, bits, table, place))

    def addresses(
        self, data: dict[str, Value], commands: tuple[int, int], is_mode_code: bool, count: int, place: str
    ) -> None:
        """Refuse a command word that contradicts the addresses or the number of words beside it."""
        if not any(commands):
            self.fail(f"{place}: command", "no command word", "that of the sender or the receiver")
        terminals, parts = (self.pair(data, key, place, 31) for key in ("lru_addr", "lru_subaddr"))
        for side, (command, terminal, part) in enumerate(zip(commands, terminals, parts, strict=True)):
            if not command:
                continue
            told = f"terminal {terminal} subaddress {part}"
            found = f"terminal {command >> 11} subaddress {command >> 5 & 31}"
            if found != told:
                self.fail(f"{place}: command", f"{command}, which is {found}", told)
            if (command >> 10 & 1) != (side == 0):
                self.fail(f"{place}: command", f"{command}", "[transmit, receive]")
            if not is_mode_code and (command & 31 or 32) != count:
                self.fail(f"{place}: wrdcnt", f"{count}", f"{command & 31 or 32}, as the command word {command} says")

    def elements(
        self, value: Value, name: str, key: str, holder: Message1553, make: Callable[..., Element1553]
    ) -> tuple[Element1553, ...]:
        if value is None:
            return ()
        made = []
        for element, entry in self.table(value, f"{name}: {key}").items():
            place = f"{name}, {element}"
            made.append(make(element, place, self.table(entry, place), holder))
        return tuple(made)

    def extent(self, table: dict[str, Value], place: str, holder: Message1553) -> tuple[int, int]:
        key = "offset" if "offset" in table else "off"
        if key not in table:
            self.fail(f"{place}: offset", "nothing", "words from the start of the data (offset, or off)")
        offset = self.integer(table[key], f"{place}: {key}", 0, 31)
        count = self.integer(self.needed(table, "cnt", place), f"{place}: cnt", 1, 32)
        if offset + count > holder.word_count:
            self.fail(f"{place}: {key}", f"words {offset} to {offset + count - 1}", f"0 to {holder.word_count - 1}")
        return offset, count

    def word_element(self, name: str, place: str, table: dict[str, Value], holder: Message1553) -> Element1553:
        self.known(table, place, (*ELEMENT_KEYS, *OWN_KEYS, "offset", "off", "cnt", "valid_if"))
        offset, count = self.extent(table, place, holder)
        schema = self.choice(table, "schema", place, tuple(WORDS_OF))
        if count != WORDS_OF[schema]:
            self.fail(f"{place}: cnt", f"{count}", f"{WORDS_OF[schema]} for {schema}")
        element = Element1553(name, schema, **self.common(table, place), offset=offset, count=count)
        return self.signal(element, table, place, (holder.name, *holder.equipment))

    def bit_element(self, name: str, place: str, table: dict[str, Value], holder: Message1553) -> Element1553:
        keys = ("offset", "off", "cnt", "msb", "lsb", "bitcnt", "valid_if")
        self.known(table, place, (*ELEMENT_KEYS, *OWN_KEYS, *keys))
        offset, count = self.extent(table, place, holder)
        if count > 4:
            self.fail(f"{place}: cnt", f"{count}", "1 to 4 words")
        schema = self.choice(table, "schema", place, BITS)
        msb, lsb = (self.integer(self.needed(table, key, place), f"{place}: {key}", 1, 16) for key in ("msb", "lsb"))
        bits = 16 * (count - 1) + lsb - msb + 1
        least = 2 if schema == "SIGNEDBITS" else 1
        if bits < least:
            self.fail(f"{place}: lsb", f"{bits} bits from {msb} to {lsb}", "msb to lsb, 1 is the most significant bit")
        stated = self.integer(self.needed(table, "bitcnt", place), f"{place}: bitcnt", 1, 64)
        if stated != bits:
            self.fail(f"{place}: bitcnt", f"{stated}", f"{bits}, from {msb} to {lsb}")
        element = Element1553(name, schema, **self.common(table, place), offset=offset, count=count, msb=msb, lsb=lsb)
        return self.signal(element, table, place, (holder.name, *holder.equipment))

    def with_validity(
        self, words: tuple[Element1553, ...], bits: tuple[Element1553, ...], table: dict[str, Value], place: str
    ) -> tuple[Element1553, ...]:
        """Return the elements of a message, each with the bit that ``valid_if`` names."""
        by_bit = {bit.name: bit for bit in bits}
        entries = {**self.table(table.get("bit_elem") or {}, place), **self.table(table.get("word_elem") or {}, place)}
        twice = [word.name for word in words if word.name in by_bit]
        if twice:
            self.fail(f"{place}, {twice[0]}", "a word and a bit element of one name", "names of their own")
        single = {bit.name for bit in bits if bit.count == 1 and bit.msb == bit.lsb}
        found = []
        for element in (*words, *bits):
            bit = self.text(self.table(entries[element.name], place), "valid_if", f"{place}, {element.name}")
            if bit and (bit not in single or bit == element.name):
                self.fail(f"{place}, {element.name}: valid_if", repr(bit), "an element of the message of one bit")
            found.append(replace(element, valid_if=by_bit[bit]) if bit else element)
        return tuple(found)

    def word(self, name: str, place: str, table: dict[str, Value]) -> Word429:
        self.known(table, place, ("wrd_data", "elem"))
        data = self.table(self.needed(table, "wrd_data", place), f"{place}: wrd_data")
        self.known(data, place, (*WORD_KEYS, "channel", "subchannel"))
        label = self.integer(self.needed(data, "label", place), f"{place}: label", 0, 0o377, base=8)
        word = Word429(
            name,
            label,
            bus=self.text(data, "bus", place),
            channel=self.optional(data, "channel", place, 0, 0xFFFF),
            subchannel=self.optional(data, "subchannel", place, 1, 256),
            sdi=self.integer(self.needed(data, "sdi", place), f"{place}: sdi", -1, 3),
            rate_hz=self.number(self.needed(data, "rate", place), f"{place}: rate"),
            equipment=self.text(data, "lru_name", place),
        )
        entries = self.table(self.needed(table, "elem", place), f"{place}: elem")
        made = tuple(self.element_429(one, f"{name}, {one}", entry, word) for one, entry in entries.items())
        return replace(word, elements=made)

    def fine(self, words: tuple[Word429, ...]) -> None:
        """Refuse a fine part of a word that does not exist."""
        names = {word.name for word in words}
        for word in words:
            for element in word.elements:
                if element.fine_of and (element.fine_of not in names or element.fine_of == word.name):
                    self.fail(f"{word.name}, {element.name}: fine_of", repr(element.fine_of), "the name of a word")

    def element_429(self, name: str, place: str, entry: Value, holder: Word429) -> Element429:
        table = self.table(entry, place)
        self.known(table, place, (*ELEMENT_KEYS, *OWN_KEYS, "lsb", "bitcnt", "status", "step", "fine_of"))
        schema = self.choice(table, "schema", place, (*BITS, "BCD", "SIGNMAG"))
        lsb = self.integer(self.needed(table, "lsb", place), f"{place}: lsb", 9, 31)
        bits = self.integer(self.needed(table, "bitcnt", place), f"{place}: bitcnt", 1, 32 - lsb)
        if schema in ("SIGNEDBITS", "SIGNMAG") and bits < 2:
            self.fail(f"{place}: bitcnt", "1", "a sign and a magnitude")
        if holder.sdi != -1 and lsb < 11:
            self.fail(f"{place}: lsb", f"{lsb}", "11 or more: bits 9 and 10 are the SDI, which the word states")
        common = self.common(table, place)
        status = usual_status(schema, common["unit"])
        if "status" in table:
            status = cast(Status, self.choice(table, "status", place, get_args(Status)))
        step = self.number(table["step"], f"{place}: step") if "step" in table else 1.0
        if step <= 0.0:
            self.fail(f"{place}: step", f"{step:g}", "a value above 0")
        element = Element429(
            name,
            schema,
            **common,
            lsb=lsb,
            bit_count=bits,
            status=status,
            step=step,
            fine_of=self.text(table, "fine_of", place),
        )
        return self.signal(element, table, place, (holder.name, holder.equipment))

    def common(self, table: dict[str, Value], place: str) -> dict[str, Any]:
        """Fields that elements of both kinds have."""
        msbval = self.number(self.needed(table, "msbval", place), f"{place}: msbval")
        if msbval < 0.0:
            self.fail(f"{place}: msbval", f"{msbval:g}", "0 (a count) or more")
        unit, text = self.text(table, "uom", place), self.text(table, "desc", place)
        return {"msbval": msbval, "unit": unit, "description": text}

    def signal(self, element: AnyElement, table: dict[str, Value], place: str, holders: tuple[str, ...]) -> AnyElement:
        """Return the element with the signal that the ICD states, or that its name implies."""
        signal = self.text(table, "signal", place)
        if "fine_of" in table and signal:
            self.fail(f"{place}: signal", repr(signal), "none beside fine_of: it is that of the word it is added to")
        if not signal:
            return by_name(element, holders) if not {"signal", "fine_of"} & table.keys() else element
        wanted = unit_of(signal)
        if wanted is None or kind_of(signal) == "truth":
            self.fail(f"{place}: signal", repr(signal), "<topic>.<field> of the canonical list that is a number")
        sign = self.number(table["sign"], f"{place}: sign") if "sign" in table else 1.0
        if sign not in (1.0, -1.0):
            self.fail(f"{place}: sign", f"{sign:g}", "1 or -1")
        transform: Transform = ""
        if "transform" in table:
            transform = cast(Transform, self.choice(table, "transform", place, get_args(Transform)[1:]))
        factor = 1.0 if transform and wanted == "deg" else canonical_factor(element.unit, signal)
        if factor is None:
            self.fail(f"{place}: uom", repr(element.unit), f"a unit of {signal}")
        if is_count(element) and (wanted or transform):
            self.fail(f"{place}: msbval", "0, a count", f"the value of the most significant bit: {signal} has a unit")
        return replace(element, signal=signal, factor=sign * factor, transform=transform)
