"""Store: records as MCAP with protobuf channels, written and read in bulk.

Damaged files are recovered.

``writer.StoreWriter`` writes, ``reader.read`` and ``reader.read_info`` read, ``info.StoreInfo`` says what a file is of,
``foreign.ForeignMcap`` reads the messages of any MCAP. Nothing is imported here: protobuf, MCAP and zstd take
a tenth of a second that ``--help`` need not spend.
"""
