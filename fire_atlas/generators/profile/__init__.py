"""Fire learnt from a short clip, and new fire generated from what was learnt (Lee et al.)."""
