"""Elastic elements, explicit and implicit in time: what is taken instead of mass-spring bodies."""
