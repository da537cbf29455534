"""From finished animations to pages: their content, their layout, their images."""
