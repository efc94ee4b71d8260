"""Loading a checkpoint: where it is, its weights, card and positions."""
