"""The references of a study, each read when it is first needed."""

from studies.base.errors import StudyError
from studies.reference.load import Reference, load_reference
from studies.reference.reference_solves import STUDY as REFERENCES
from studies.reference.reference_solves import reference_solves
from studies.scene.scene import Scene
from studies.store.record import Status
from studies.sweep.stored.known import Known


class References:
    """The references of scenes, each read when it is first asked for."""

    def __init__(self, known: Known) -> None:
        self.known = known
        self.found: dict[str, Reference | StudyError | None] = {}

    def of(self, scene: Scene) -> Reference | None:
        """None where there is none; see `problem`."""
        if scene.name not in self.found:
            try:
                self.found[scene.name] = load_reference(self.known.root, scene)
            except StudyError as error:
                self.found[scene.name] = error
        found = self.found[scene.name]
        return None if isinstance(found, StudyError) else found

    def problem(self, scene: Scene) -> StudyError | None:
        """Why a scene with a plan has none. Solutions that are there and went well are not read for that."""
        entries = [self.known.of_solve(solve) for solve in reference_solves(scene)]
        if scene.name not in self.found and all(entry is not None and entry.status == Status.OK for entry in entries):
            return None
        self.of(scene)
        found = self.found[scene.name]
        return found if isinstance(found, StudyError) else None

    def state(self, scene: Scene) -> str:
        """What tells it from any other."""
        states = self.known.folder(REFERENCES).states
        files = [solve.path(self.known.root).name for solve in reference_solves(scene)]
        return " ".join(f"{file} {states.get(file)}" for file in files)
