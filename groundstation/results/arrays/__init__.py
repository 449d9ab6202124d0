"""Typed arrays behind the figures of each analysis, the columns of arrays/*.parquet."""
