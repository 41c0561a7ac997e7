"""The one exception type of this package."""


class MassSpringError(ValueError):
    """Bad input to the mass-spring solver; the message names the thing, the value, the limit and the way out."""
