"""The version of the tool, which manifests, caches and pages state."""

__version__ = "0.1.0"
