"""The league of engines: its table, a card for each engine, and the page."""
