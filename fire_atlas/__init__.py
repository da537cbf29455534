"""fire-atlas: fire in, finished sprite atlases with flying fire-flakes out."""

__version__ = "0.1.0"
