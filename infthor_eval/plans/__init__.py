"""Plan-level evaluation (Algorithm 2): an agent meets a trajectory plan by plan, each time anew."""
