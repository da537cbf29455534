"""Files appear whole or not at all, and are known again."""
