"""`python -m fembeam`."""

import sys

from fembeam.cli import main

if __name__ == "__main__":
    sys.exit(main())
