"""report.html: one file that shows a results folder in any browser, without server and network."""
