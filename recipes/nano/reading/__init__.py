"""Learning to read: sequences of what frames show, with questions, and the first weights."""
