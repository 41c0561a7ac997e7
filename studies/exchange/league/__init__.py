"""The league of engines: a frozen set of scenes, and entries by file that are judged on it."""

FOLDER = "league"
"""Of the results: what is entered, the table and the chart."""
