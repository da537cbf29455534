"""Fault campaigns that anyone can run: ``python -m tests.campaign kill --count 1000 --seed 7``."""
