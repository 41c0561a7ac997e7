"""Questions asked of both solvers: scenes, runs, metrics, results and charts. What a user imports is here."""

from studies.base.face import lazy

TYPE_CHECKING = False
"""As typing has it, which would be loaded first: the command line listens for Ctrl-C right after this file."""
if TYPE_CHECKING:
    from massspring.methods import METHODS
    from massspring.methods.barycentre import Barycentre
    from massspring.methods.constraints.baumgarte import Baumgarte
    from massspring.methods.constraints.post_stabilization import PostStabilization
    from massspring.methods.constraints.projection import Projection
    from massspring.methods.constraints.shake import Shake
    from massspring.methods.element import Element
    from massspring.methods.free import Free
    from massspring.methods.implicit_springs import ImplicitSprings
    from massspring.methods.implicit_volume import ImplicitVolume
    from massspring.methods.method import Method
    from massspring.methods.penalty import Penalty
    from massspring.methods.pressure import Pressure
    from massspring.methods.pyramid import Pyramid
    from massspring.methods.xpbd import Xpbd
    from studies.advice.answer import Advice, Recommendation, advise, recommended
    from studies.base.errors import StudyError
    from studies.calibration.calibrate import calibrate
    from studies.calibration.stored import calibrated
    from studies.catalog import STUDIES
    from studies.catalog.study import Chart, Study
    from studies.geometry.api.organs import organ
    from studies.geometry.organs import SHAPES
    from studies.metrics.metric import Metric
    from studies.metrics.metrics import METRICS
    from studies.metrics.run import Run
    from studies.metrics.table import study_table
    from studies.runs.case import BodyRecipe, Case
    from studies.runs.own import own_law
    from studies.runs.run import measure
    from studies.scene.scene import ForceOutput, Held, Lumen, Organ, ReferencePlan, Scene
    from studies.scene.start import InitialConditions
    from studies.scene.tissues import Tissue
    from studies.scenes import SCENES
    from studies.scenes.ball_clamped import BALL_CLAMPED
    from studies.scenes.ball_ringing import BALL_RINGING
    from studies.scenes.ball_squeeze import BALL_SQUEEZE
    from studies.scenes.bladder_fill import BLADDER_FILL
    from studies.scenes.kidney_probe import KIDNEY_PROBE
    from studies.scenes.liver_press import LIVER_PRESS
    from studies.scenes.liver_probe import LIVER_PROBE
    from studies.scenes.spleen_sag import SPLEEN_SAG
    from studies.scenes.stomach_press import STOMACH_PRESS
    from studies.scenes.stomach_probe import STOMACH_PROBE
    from studies.scenes.stomach_slide import STOMACH_SLIDE
    from studies.store.record import Record, Status, read_record
    from studies.sweep.load import load_runs
    from studies.sweep.run_studies import run_studies

    __version__: str

_FACE = {
    "BALL_CLAMPED": "studies.scenes.ball_clamped",
    "BALL_RINGING": "studies.scenes.ball_ringing",
    "BALL_SQUEEZE": "studies.scenes.ball_squeeze",
    "BLADDER_FILL": "studies.scenes.bladder_fill",
    "KIDNEY_PROBE": "studies.scenes.kidney_probe",
    "LIVER_PRESS": "studies.scenes.liver_press",
    "LIVER_PROBE": "studies.scenes.liver_probe",
    "METHODS": "massspring.methods",
    "METRICS": "studies.metrics.metrics",
    "SCENES": "studies.scenes",
    "SHAPES": "studies.geometry.organs",
    "SPLEEN_SAG": "studies.scenes.spleen_sag",
    "STOMACH_PRESS": "studies.scenes.stomach_press",
    "STOMACH_PROBE": "studies.scenes.stomach_probe",
    "STOMACH_SLIDE": "studies.scenes.stomach_slide",
    "STUDIES": "studies.catalog",
    "Advice": "studies.advice.answer",
    "Barycentre": "massspring.methods.barycentre",
    "Baumgarte": "massspring.methods.constraints.baumgarte",
    "BodyRecipe": "studies.runs.case",
    "Case": "studies.runs.case",
    "Chart": "studies.catalog.study",
    "Element": "massspring.methods.element",
    "ForceOutput": "studies.scene.scene",
    "Free": "massspring.methods.free",
    "Held": "studies.scene.scene",
    "ImplicitSprings": "massspring.methods.implicit_springs",
    "ImplicitVolume": "massspring.methods.implicit_volume",
    "InitialConditions": "studies.scene.start",
    "Lumen": "studies.scene.scene",
    "Method": "massspring.methods.method",
    "Metric": "studies.metrics.metric",
    "Organ": "studies.scene.scene",
    "Penalty": "massspring.methods.penalty",
    "PostStabilization": "massspring.methods.constraints.post_stabilization",
    "Pressure": "massspring.methods.pressure",
    "Projection": "massspring.methods.constraints.projection",
    "Pyramid": "massspring.methods.pyramid",
    "Recommendation": "studies.advice.answer",
    "Record": "studies.store.record",
    "ReferencePlan": "studies.scene.scene",
    "Run": "studies.metrics.run",
    "Scene": "studies.scene.scene",
    "Shake": "massspring.methods.constraints.shake",
    "Status": "studies.store.record",
    "Study": "studies.catalog.study",
    "StudyError": "studies.base.errors",
    "Tissue": "studies.scene.tissues",
    "Xpbd": "massspring.methods.xpbd",
    "advise": "studies.advice.answer",
    "calibrate": "studies.calibration.calibrate",
    "calibrated": "studies.calibration.stored",
    "load_runs": "studies.sweep.load",
    "measure": "studies.runs.run",
    "organ": "studies.geometry.api.organs",
    "own_law": "studies.runs.own",
    "read_record": "studies.store.record",
    "recommended": "studies.advice.answer",
    "run_studies": "studies.sweep.run_studies",
    "study_table": "studies.metrics.table",
}
"""Where each name lives; its module is loaded when the name is asked for."""

if not TYPE_CHECKING:
    __all__ = list(_FACE)
    __getattr__, __dir__ = lazy(__name__, _FACE)
