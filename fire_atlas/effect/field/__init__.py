"""The buoyancy field Bv that flakes fly in, solved on a coarse grid; wind and eddies."""
