"""Variants of implicit constraint enforcement that keep one volume by other rules (docs/theory.md, section 10)."""
