"""The one exception of this package."""


class StudyError(ValueError):
    """Bad input to a study: the message is one sentence naming the thing, the value, the limit and the way out."""


class DoesNotApply(StudyError):
    """A method does not apply to a scene or a body: no failure, and the message says why."""


class DamagedFile(StudyError):
    """A stored file does not say what was written."""


class OpenElsewhere(StudyError):
    """A stored file is open for writing in another program."""


class OtherVersion(StudyError):
    """A stored file has the layout of another version."""
