"""``python -m cli``: the command line where the ``bimvox`` script is not on the path."""

import sys

from cli.main import run

sys.exit(run())
