"""The methods of massspring, for `from studies import Free`."""

from massspring import *  # noqa: F403
