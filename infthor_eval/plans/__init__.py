"""Plan-level evaluation (Algorithm 2): an agent meets a long trajectory plan by plan, each from the
true history."""
