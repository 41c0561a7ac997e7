"""Cases of a test that only `make verify` runs, next to quicker ones that every run of the tests has."""

from collections.abc import Callable, Iterable
from typing import Any

import pytest


def campaign(*values: Any) -> Any:
    """One case of `parametrize`, as a campaign."""
    return pytest.param(*values, marks=pytest.mark.campaign)


def campaigns_but(cases: Iterable[Any], quick: Callable[[Any], bool]) -> list[Any]:
    """All cases of `parametrize`; those that are not quick as campaigns."""
    return [case if quick(case) else campaign(case) for case in cases]
