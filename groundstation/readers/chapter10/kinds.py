"""Types of packets, and the names that TMATS has for the channels that hold them.

Source: IRIG 106-22 Chapter 11, table 11-8.
"""

from collections.abc import Mapping
from types import MappingProxyType

TMATS, EVENT, TIME, MIL_STD_1553, DISCRETE, ARINC_429 = 0x01, 0x02, 0x11, 0x19, 0x29, 0x38
NAMES: Mapping[int, str] = MappingProxyType(
    {
        0x00: "user-defined",
        0x01: "TMATS",
        0x02: "recording event",
        0x03: "index",
        0x08: "PCM format 0",
        0x09: "PCM",
        0x11: "time",
        0x12: "network time",
        0x19: "MIL-STD-1553",
        0x1A: "16PP194",
        0x21: "analog",
        0x29: "discrete",
        0x30: "message",
        0x38: "ARINC-429",
        0x40: "video format 0",
        0x41: "video format 1",
        0x42: "video format 2",
        0x43: "video format 3",
        0x44: "video format 4",
        0x48: "image format 0",
        0x49: "image format 1",
        0x4A: "image format 2",
        0x50: "UART",
        0x58: "IEEE 1394 format 0",
        0x59: "IEEE 1394 format 1",
        0x60: "parallel",
        0x68: "Ethernet",
        0x69: "ARINC-664",
        0x70: "TSPI (NMEA)",
        0x71: "TSPI (EAG ACMI)",
        0x72: "TSPI (ACTTS)",
        0x78: "CAN",
        0x79: "Fibre Channel",
        0x7A: "Fibre Channel format 1",
    }
)
# Types that a channel may hold by its kind in TMATS (R-x\\CDT-n); a kind that is not here says nothing.
OF_CHANNEL: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {
        "TIMEIN": (0x10, 0x11, 0x12),
        "1553IN": (0x18, 0x19, 0x1A),
        "429IN": (0x38,),
        "PCMIN": (0x08, 0x09),
        "ANAIN": (0x20, 0x21),
        "DISIN": (0x28, 0x29),
        "UARTIN": (0x50,),
        "MSGIN": (0x30,),
        "VIDIN": (0x40, 0x41, 0x42, 0x43, 0x44),
        "ETHIN": (0x68, 0x69),
        "CANIN": (0x78,),
    }
)


def name_of(kind: int) -> str:
    """Name of a type, its number where it has none."""
    return NAMES.get(kind, f"type {kind:#04x}")
