"""Meshes that are finer where a scene holds and touches the body, for references and bodies."""
