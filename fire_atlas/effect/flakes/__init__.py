"""Fire-flakes, the paper's name for sparks: emission, flight, appearance, drawing, tracks."""
