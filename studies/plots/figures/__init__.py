"""Pictures that are no charts of a study: the organs, and the figures of the paper."""
