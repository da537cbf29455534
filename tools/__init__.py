"""What is run by hand: measurements of time, memory, sizes and looks."""
