"""``python -m bimvox_cli``: the command line if the ``bimvox`` script is not on the path."""

import sys

from bimvox_cli.main import run

sys.exit(run())
