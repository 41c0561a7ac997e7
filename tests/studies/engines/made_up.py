"""Workers of no cluster, for tests of who gets what."""

from studies.engines.dask import Answer, Found


def worker(name, threads=1, memory=0.0):
    return Found(name, threads, memory)


class MadeUp:
    """Lines to workers that answer as `value` says, in order; without a value they leave."""

    session = "session"

    def __init__(self, value, **workers):
        self.known = dict(workers)
        self.value, self.answers, self.sent = value, [], []

    def workers(self):
        """Those of now."""
        return dict(self.known)

    def send(self, address, setup, request, label):
        """Answers at once."""
        self.sent.append((address, request))
        value = self.value(address, request)
        if value is None:
            del self.known[address]
        else:
            self.answers.append(Answer(label, address, value))

    def drop(self, address):
        """What it was asked is not answered."""
        self.answers = [answer for answer in self.answers if answer.address != address]

    def next_answer(self, seconds):
        """The first that was not read yet."""
        return self.answers.pop(0) if self.answers else None
