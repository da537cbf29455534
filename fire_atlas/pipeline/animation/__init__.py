"""From an opened source to finished animations."""
