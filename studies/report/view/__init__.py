"""Stored cases with their reference in one file for ParaView."""
