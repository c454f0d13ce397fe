"""``python -m bimvox_cli``: the command line if the ``bimvox`` script is not on the path."""

from bimvox_cli.start import main

main()
