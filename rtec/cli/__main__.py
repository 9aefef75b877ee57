"""``python -m rtec.cli``: the command line where the ``rtec`` script is not on the path."""

import sys

from rtec.cli import main

sys.exit(main())
