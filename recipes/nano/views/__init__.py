"""Views of rooms in which things are put about at random, with labels, for training to see."""
