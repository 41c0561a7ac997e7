"""Measured silicone: a cast beam under its weight and two tip loads, measured by others, predicted by ours."""
