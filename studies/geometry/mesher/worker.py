"""Process that meshes one recipe: `python -m studies.geometry.mesher.worker JOB.npz OUT.npz`.

gmsh can hang without a word or crash; here it takes nobody with it. A StudyError goes to the output file as a sentence.
"""

import json
import sys

import numpy as np

from studies.base.errors import StudyError
from studies.geometry.mesher.organ_recipe import build


def main(job_path: str, out_path: str) -> int:
    """Read the job, write the mesh or the sentence of a StudyError; 0 or 2."""
    with np.load(job_path, allow_pickle=False) as job:
        arrays = {key: job[key] for key in job.files if key != "recipe"}
        recipe = json.loads(str(job["recipe"]))
    try:
        result = build(recipe, arrays)
    except StudyError as error:
        np.savez(out_path, error=np.array(str(error)))
        return 2
    np.savez(out_path, allow_pickle=False, **result)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2]))
