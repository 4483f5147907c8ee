"""`python -m fembeam.cli`."""

import sys

from fembeam.cli import main

sys.exit(main())
