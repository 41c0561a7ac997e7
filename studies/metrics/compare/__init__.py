"""Two results folders side by side: what moved between two versions, machines or people."""
