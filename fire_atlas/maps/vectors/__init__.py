"""Vectors in images: of motion and of haze."""
