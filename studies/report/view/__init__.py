"""Stored cases beside their reference in one file for ParaView."""
