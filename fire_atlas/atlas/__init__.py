"""The asset half: encode, trim, pack, pages."""
