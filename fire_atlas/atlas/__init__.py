"""Encode frames, trim them, pack them onto pages and draw these. Knows no file format."""
