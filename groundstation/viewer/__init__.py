"""Tables and results of a flight as a Rerun recording.

The only room that imports rerun. This module imports nothing heavy.
"""

import os

os.environ.setdefault("RUST_LOG", "off")  # Rerun's own log goes to stderr; what matters it raises (strict mode)
