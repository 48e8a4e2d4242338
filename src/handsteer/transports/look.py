"""``python -m handsteer.transports.look``: prints the ROS 2 domain that the environment names, as JSON."""

import json
import os
import sys

from handsteer.errors import TransportError
from handsteer.transports.dds.network import network
from handsteer.transports.dds.observer import observe_domain


def main() -> None:
    """Print nodes, topics and what is amiss; exit code 2 when the domain cannot be joined."""
    try:
        seen = observe_domain(network(os.environ)).as_dict()
    except TransportError as error:
        sys.stderr.write(f"{error}\n")
        sys.stderr.flush()
        os._exit(2)  # an engine that is half started is not waited for
    sys.stdout.write(json.dumps(seen))


if __name__ == "__main__":
    main()
