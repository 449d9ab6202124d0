"""Names of the files in a folder of results.

They tell results from logs without loading the readers.
"""

SUMMARY, MANIFEST, ARRAYS, TABLES = "summary.json", "manifest.json", "arrays", "tables"
OLD_ARRAYS = "results.parquet"  # an earlier name of that folder, still read
INDEX_JSON, INDEX_CSV = "index.json", "index.csv"
CORRECTED = ".corrected.mcap"  # end of the name of what stands beside a flight's MCAP, and is none
