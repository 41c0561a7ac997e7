"""A case: described, prepared, run and judged."""
