"""``handsteer signs``: the signs themselves. One file per verb."""

from cyclopts import App

_EXAMPLES = """Examples:
  handsteer signs list                 the signs, and what each does
  handsteer signs calibrate            adapt the six signs to you
  handsteer signs collect --label Hi   show a new sign to the camera
  handsteer signs train                learn it
  handsteer signs evaluate photos/     how well signs are recognised
"""

app = App(
    name="signs",
    help="List, evaluate, calibrate and teach signs.",
    help_epilogue=_EXAMPLES,
    help_format="plaintext",
    result_action="return_value",
)
# Named, not imported: a verb's module is loaded when it is used.
for verb, function in {
    "list": "train:list_signs",
    "evaluate": "evaluate:evaluate",
    "calibrate": "calibrate:calibrate",
    "collect": "collect:collect",
    "import": "collect:import_keypoints",
    "train": "train:train",
    "export": "train:export",
}.items():
    app.command(f"handsteer.plugins.teach.verbs.{function}", name=verb, help_epilogue="")
