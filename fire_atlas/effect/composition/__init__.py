"""Motion blur and composition in linear light."""
