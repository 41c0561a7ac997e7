"""The studies, one file each. Adding one: a file and a line in STUDIES."""

from studies.catalog.accuracy import ACCURACY
from studies.catalog.cutting import CUTTING
from studies.catalog.frame_rate import FRAME_RATE
from studies.catalog.laws import LAWS_STUDY
from studies.catalog.literature import LITERATURE_STUDY
from studies.catalog.methods import METHODS_STUDY
from studies.catalog.organs import ORGANS
from studies.catalog.stability_map import STABILITY_MAP
from studies.catalog.stress import STRESS
from studies.catalog.study import Chart, Study
from studies.catalog.volume_loss import VOLUME_LOSS
from studies.catalog.work_precision import WORK_PRECISION

# In this order they run: the headline first, so that `make study` draws volume and squeeze early.
STUDIES: tuple[Study, ...] = (
    VOLUME_LOSS,
    STABILITY_MAP,
    FRAME_RATE,
    WORK_PRECISION,
    ORGANS,
    STRESS,
    LAWS_STUDY,
    METHODS_STUDY,
    LITERATURE_STUDY,
    ACCURACY,
    CUTTING,
)

__all__ = ["STUDIES", "Chart", "Study"]
