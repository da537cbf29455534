"""Files for engines and tools."""
