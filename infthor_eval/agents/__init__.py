"""Plan-level interactive evaluation (Algorithm 2): an agent meets a long trajectory plan by plan."""
