"""The mesh of an organ: its checks, quality, curved sides, and walls."""
