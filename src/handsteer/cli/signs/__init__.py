"""``handsteer signs``: the signs themselves. One file a verb."""

from cyclopts import App

_EXAMPLES = """Examples:
  handsteer signs list                 the signs, and what each does
  handsteer signs evaluate photos/     how well they are told in labelled photos
"""

app = App(
    name="signs",
    help="The signs: what each does, and how well they are told.",
    help_epilogue=_EXAMPLES,
    help_format="plaintext",
    result_action="return_value",
)
# Named, not imported: a verb's module is loaded when it is used.
app.command("handsteer.cli.signs.evaluate:evaluate", name="evaluate")
app.command("handsteer.cli.signs.list_signs:list_signs", name="list")
