"""The same campaign against the finite-element reference: each end named, each state of rest measured again."""
