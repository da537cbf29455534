"""Export to Unity 2021.3 and later."""
