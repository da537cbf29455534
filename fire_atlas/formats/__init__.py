"""Files that belong to no engine, each written and read in one module."""
