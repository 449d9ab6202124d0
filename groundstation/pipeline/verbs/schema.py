"""Command that writes the JSON Schemas of summary and installations.

``python -m groundstation.pipeline.verbs.schema SUMMARY INSTALLATIONS``.
"""

import sys
from pathlib import Path

from groundstation.results.files import json_text
from groundstation.results.schema import installations_schema, schema_text
from groundstation.systems import systems

if __name__ == "__main__":
    Path(sys.argv[1]).write_text(schema_text(systems().answer_types), encoding="utf-8")
    Path(sys.argv[2]).write_text(json_text(installations_schema()), encoding="utf-8")
