"""Bytes by which a file of the store is recognised.

Nothing is imported, so that every other log is opened without the store.
"""

MAGIC = b"\x89MCAP0\r\n"
PACKAGE = "groundstation"  # package of the message types
METADATA_NAME = "groundstation"
RECORD_PREFIX = 9  # opcode and length, which the length does not count
SEARCH_BYTES = 1 << 20  # part of a damaged file, at its beginning or end, searched for a definition
HEADER_OPCODE = 1
