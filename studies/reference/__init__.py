"""A scene solved by finite elements, with its error bar."""
