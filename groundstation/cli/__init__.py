"""Command line: parses, calls the pipeline, prints, sets the exit code.

It asks for linear algebra in one thread unless the user says otherwise, before numpy is loaded: matrices here are
small, and threads that wait for each other cost several times what they work (a session of fifty vehicles four to six
times).
Worker processes inherit it.
"""

import os

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
