"""One equation per function, compiled: scalars and arrays in, arrays out; nothing here allocates memory or refers to a
scene.

Order of arguments: positions, topology, parameters, output. `add_…` adds to its output array, `…_into` overwrites it.
Equation numbers are those of docs/theory.md.
"""
