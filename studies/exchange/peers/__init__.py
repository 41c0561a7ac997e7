"""Other programs as contestants, one adapter file each: they read an exported scene and hand results in."""
