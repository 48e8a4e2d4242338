"""What a lesson comes to, without its training."""

from handsteer.plugins.teach.dataset import LabelSummary
from handsteer.plugins.teach.evaluation.intervals import Share
from handsteer.plugins.teach.evaluation.photo_metrics import Confusion
from handsteer.plugins.teach.report import CustomSignFigures, TrainingReport

REPORT = TrainingReport(
    signs=(CustomSignFigures(LabelSummary("Peace", 5, 299, 1, 1), False, 0.9, Share(580, 598)),),
    held_out="take",
    confusion=Confusion(("Peace", "NONE"), ((580, 18), (0, 0))),
    made=Share(1, 37_000),
)
