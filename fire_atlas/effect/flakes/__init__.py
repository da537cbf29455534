"""Fire-flakes: emission, flight, embers, drawing, tracks."""
