"""SpatialVLA: PaliGemma 2 whose patches know where in space they lie, actions as tokens of spherical bins."""
