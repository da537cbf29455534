"""Generate fire from a profile: particles carry parts of its clip upwards (Lee et al., III-C)."""
