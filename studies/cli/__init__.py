"""Words in, sentences out: the command line."""
