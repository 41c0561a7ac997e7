"""One equation per function, compiled: scalars and arrays in, arrays out; nothing here allocates or knows a scene.

Order of arguments: positions, topology, parameters, output. `add_…` adds to what it is given, `…_into` overwrites it.
Equation numbers are those of docs/theory.md.
"""
