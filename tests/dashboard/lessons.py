"""What a lesson comes to, without its training."""

from handsteer.training.custom.dataset import LabelSummary
from handsteer.training.custom.report import CustomSignFigures, TrainingReport
from handsteer.training.evaluation.intervals import Share
from handsteer.training.evaluation.photo_metrics import Confusion

REPORT = TrainingReport(
    signs=(CustomSignFigures(LabelSummary("Peace", 5, 299, 1, 1), False, 0.9, Share(580, 598)),),
    held_out="take",
    confusion=Confusion(("Peace", "NONE"), ((580, 18), (0, 0))),
    made=Share(1, 37_000),
)
