"""The mesh doctor: measures of a mesh, its faults, and the option that repairs each."""
