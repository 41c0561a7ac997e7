"""How a new file is laid out: by the calls of HDF5 itself, with the group by which ParaView opens it."""
