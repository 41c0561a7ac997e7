"""A campaign that measures trust: random scenes that nobody chose, run as a user runs them, judged by references."""
