"""The buoyancy field that carries the flakes."""
