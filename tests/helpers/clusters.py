"""Ray clusters of two nodes on this machine."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest


@contextmanager
def two_nodes() -> Iterator[tuple[Any, Any]]:
    """A cluster with a processor on each of two nodes, and the one that can be taken away."""
    ray = pytest.importorskip("ray", reason="Ray is an extra: pip install 'infthor-eval[ray]'")
    from ray.cluster_utils import Cluster

    ray.shutdown()  # whatever a test before this one was connected to
    node = {"num_cpus": 1, "object_store_memory": 100 * 2**20}
    cluster = Cluster(initialize_head=True, head_node_args=node)
    try:
        second = cluster.add_node(**node)
        ray.init(address=cluster.address, log_to_driver=False, logging_level="error")
        yield cluster, second
    finally:
        ray.shutdown()
        cluster.shutdown()
