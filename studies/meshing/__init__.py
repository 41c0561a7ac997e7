"""Meshes finer where a scene holds and touches the body, for references and for bodies."""
