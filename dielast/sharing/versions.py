"""The versions on which results may depend: workers of a cluster and an interrupted run must share them."""

import numpy as np

from dielast import __version__

VERSIONS = {"dielast": __version__, "numpy": np.__version__}
