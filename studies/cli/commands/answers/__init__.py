"""Commands that answer a question: which recipe, which parameters, is the reference right."""
