"""Forces and energies, one equation per function."""
