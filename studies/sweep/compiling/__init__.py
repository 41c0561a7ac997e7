"""Compiled code made ready before it is needed, in two processes that share what they compile."""
