"""Source ``silk``: sheets of flame moved by springs (Balci & Foroosh)."""
