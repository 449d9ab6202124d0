"""ICDs: the meaning of the words of MIL-STD-1553 and ARINC 429 buses.

They are DTS files in YAML; some are shipped.
"""

from groundstation.readers.icd.dump import to_yaml
from groundstation.readers.icd.instances import numbered
from groundstation.readers.icd.load import load, named_icd, shipped, shipped_names
from groundstation.readers.icd.model import (
    ANY_SDI,
    Element,
    Element429,
    Element1553,
    Icd,
    Message1553,
    Word429,
    labels_of,
)
from groundstation.readers.icd.signals import TRUE_TRACK, signal_values, word_values
from groundstation.readers.icd.suggest import BusEntry, suggest
from groundstation.readers.icd.words_429 import decode_429, encode_429, has_odd_parity, status_of, step_429
from groundstation.readers.icd.words_1553 import decode_1553, encode_1553, usable_1553

__all__ = [
    "ANY_SDI",
    "TRUE_TRACK",
    "BusEntry",
    "Element",
    "Element429",
    "Element1553",
    "Icd",
    "Message1553",
    "Word429",
    "decode_429",
    "decode_1553",
    "encode_429",
    "encode_1553",
    "has_odd_parity",
    "labels_of",
    "load",
    "named_icd",
    "numbered",
    "shipped",
    "shipped_names",
    "signal_values",
    "status_of",
    "step_429",
    "suggest",
    "to_yaml",
    "usable_1553",
    "word_values",
]
