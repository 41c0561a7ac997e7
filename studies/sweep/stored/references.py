"""The references of studies, each read when it is first needed."""

from studies.base.errors import StudyError
from studies.reference.load import Reference, load_reference
from studies.reference.reference_solves import STUDY as REFERENCES
from studies.reference.reference_solves import reference_solves
from studies.scene.as_json import scene_to_json
from studies.scene.scene import Scene
from studies.store.record import Status
from studies.sweep.stored.known import Known


class References:
    """The references of scenes, each read when it is first asked for, and once however many studies ask."""

    def __init__(self, known: Known) -> None:
        self.known = known
        self.found: dict[str, Reference | StudyError | None] = {}
        """By the scene as JSON: a study of one's own may have another scene of the same name."""

    def of(self, scene: Scene) -> Reference | None:
        """None where there is none; see `problem`."""
        found = self._look(scene)
        return None if isinstance(found, StudyError) else found

    def _look(self, scene: Scene) -> Reference | StudyError | None:
        key = scene_to_json(scene)
        if key not in self.found:
            try:
                self.found[key] = load_reference(self.known.root, scene)
            except StudyError as error:
                self.found[key] = error
        return self.found[key]

    def problem(self, scene: Scene) -> StudyError | None:
        """Why a scene with a plan has none. Solutions that are there and went well are not read for that."""
        entries = [self.known.of_solve(solve) for solve in reference_solves(scene)]
        fine = all(entry is not None and entry.status == Status.OK for entry in entries)
        if fine and scene_to_json(scene) not in self.found:
            return None
        found = self._look(scene)
        return found if isinstance(found, StudyError) else None

    def state(self, scene: Scene) -> str:
        """What tells it from any other."""
        states = self.known.folder(REFERENCES).states
        files = [solve.path(self.known.root).name for solve in reference_solves(scene)]
        return " ".join(f"{file} {states.get(file)}" for file in files)
