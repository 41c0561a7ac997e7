"""Pictures that do not belong to a study: the organs, and the figures of the paper."""
