"""Encode frames, trim them, pack them onto pages and draw the pages. Knows no file format."""
