"""What was read off the files of a folder, kept with its index until a file changes, or what else it depends on."""

import json
import time
from collections.abc import Callable
from typing import Any

from studies.base.shelf import Kept
from studies.store.index.folder import EACH, FolderIndex


class Room:
    """JSON-able values by the name of a file. `keep` is called at the end."""

    def __init__(self, folder: FolderIndex, name: str) -> None:
        self.folder, self.name = folder, name
        self.kept, self.fresh = folder.shelf.load(name), dict[str, Kept]()
        self.kept_at = time.monotonic()

    def get(self, file: str, depends: str, make: Callable[[], Any]) -> Any:
        """What `make` says of a file, or said when the file and `depends` were the same. Errors of `make` pass."""
        state = f"{self.folder.states[file]} {depends}"
        before = self.kept.get(file)
        if before is not None and before.state == state:
            return json.loads(before.text)
        value = make()
        self.fresh[file] = Kept(state, json.dumps(value))
        if time.monotonic() - self.kept_at > EACH:
            self._put()
        return value

    def keep(self) -> None:
        """Keeps what is new, and forgets the files that are gone."""
        self._put([file for file in self.kept if file not in self.folder.entries])

    def _put(self, gone: list[str] | None = None) -> None:
        self.folder.shelf.put(self.name, self.fresh, gone or ())
        self.kept_at, self.fresh = time.monotonic(), {}
