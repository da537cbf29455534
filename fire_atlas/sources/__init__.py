"""Sources of fire: files, profiles and silk. Each kind becomes a ``Clip``."""
