"""Elastic finite elements, explicit and implicit in time: the usual alternative to mass-spring bodies."""
