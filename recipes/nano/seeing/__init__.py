"""Learning to see: labelled views, what they show, and the tower that names it."""
