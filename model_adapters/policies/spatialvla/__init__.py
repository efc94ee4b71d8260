"""SpatialVLA: PaliGemma 2 with 3D positions of patches; actions are tokens of spherical bins."""
