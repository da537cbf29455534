"""Tests of source silk."""
