"""``python -m warp_contact``: the command line."""

import sys

from warp_contact.command.cli import main

sys.exit(main())
