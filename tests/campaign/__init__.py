"""Fault campaigns: what a build does when everything goes wrong, as often as one has time for.

``python -m tests.campaign NAME --count N --seed S``; a short run of each is among the tests.
"""
