"""Tables and results of a flight as a Rerun recording; the only room that imports rerun. Imports nothing heavy."""

import os

os.environ.setdefault("RUST_LOG", "off")  # Rerun's own log goes to stderr; what matters it raises (strict mode)
