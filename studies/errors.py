"""The one exception of this package."""


class StudyError(ValueError):
    """Bad input to a study: the message is one sentence naming the thing, the value, the limit and the way out."""
