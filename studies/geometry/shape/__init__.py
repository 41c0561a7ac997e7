"""Organs as level functions, and regions on them."""
