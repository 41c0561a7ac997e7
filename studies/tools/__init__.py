"""Questions with an answer: which body, which parameters, what breaks, what is true, what is missing."""
