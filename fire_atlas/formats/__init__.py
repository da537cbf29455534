"""File formats that are not specific to an engine; each is written and read in one module."""
