"""What people look at: charts, tables and the summary of a results folder."""
