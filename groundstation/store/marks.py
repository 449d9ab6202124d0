"""Bytes by which a file of the store is recognised.

Nothing is imported, so that every other log is opened without the store.
"""

MAGIC = b"\x89MCAP0\r\n"
PACKAGE = "groundstation"  # of the message types
METADATA_NAME = "groundstation"
RECORD_PREFIX = 9  # opcode and length, which the length does not count
SEARCH_BYTES = 1 << 20  # of the beginning or the end of a damaged file, in which a definition is looked for
HEADER_OPCODE = 1
