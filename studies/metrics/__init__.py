"""Metrics: numbers computed from a run."""
