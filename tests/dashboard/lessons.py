"""What a lesson comes to, without its training."""

from handsteer.signs.intervals import Share
from handsteer.signs.metrics import Confusion
from handsteer.signs.teaching.dataset import LabelSummary
from handsteer.signs.teaching.train import TaughtSign, TeachingReport

REPORT = TeachingReport(
    signs=(TaughtSign(LabelSummary("Peace", 5, 299, 1, 1), False, 0.9, Share(580, 598)),),
    held_out="take",
    confusion=Confusion(("Peace", "NONE"), ((580, 18), (0, 0))),
    made=Share(1, 37_000),
)
