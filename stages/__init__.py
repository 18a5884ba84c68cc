"""The DVC stages: thin shells around the rooms of `reproduction`, one module per stage; those of the studies too.

A stage computes with one thread per process: its products are small, and sums must not depend on the machine. This is
said here because a library of linear algebra asks once, when it is loaded.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_variable] = "1"
