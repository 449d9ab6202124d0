"""``python -m groundstation.pipeline.verbs.schema FILE`` writes the JSON Schema of summary.json, all analyses in it."""

import sys
from pathlib import Path

from groundstation.estimators.analyses import ANSWER_TYPES
from groundstation.results.schema import schema_text

if __name__ == "__main__":
    Path(sys.argv[1]).write_text(schema_text(ANSWER_TYPES), encoding="utf-8")
