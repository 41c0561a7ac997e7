"""Archives of results: one file that contains the code to draw its charts again."""
