"""Reports of a results folder: charts, tables and summaries."""
