"""handsteer on a machine whose wall clock is ahead: ``with_clock.py SECONDS camera --transport dds …``.

Two processes of one machine share its clock; so this one is given another before any of handsteer is loaded. The
monotonic clock stays as it is.
"""

import sys
import time

ahead_s = float(sys.argv.pop(1))
real_time = time.time
time.time = lambda: real_time() + ahead_s

from handsteer.cli import main  # noqa: E402

main()
