"""Volumes of napari's layers in 3D at full resolution, by Slabstream."""
