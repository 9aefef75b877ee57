"""``python -m rtec``: the command line where the ``rtec`` script is not on the path."""

import sys

from rtec.cli import main

if __name__ == "__main__":
    sys.exit(main())
