"""What the pages quote of the page, of messages and of output is what handsteer shows."""

import ast
import re
from functools import cache

from tests.docs.pages import DOCS, PAGES, ROOT, Part, blocks, code, italics, prose

CATALOGUE = ROOT / "src/handsteer/plugins/page/static/languages/de.js"
OF_THE_PAGE = [DOCS / f"{name}.md" for name in ("index", "page", "calibrate", "recordings", "study", "teach", "worlds")]

STRESSED = {"not", "read before", "with the profile", "otherwise read as", "views", "reach"}
"""In italics for another reason: columns of a table, and terms."""

OF_THE_BROWSER = {"Install", "Add to Home Screen"}
WITHOUT_SCRIPTS = {"Continue to handsteer"}
"""On a page that has its words from Python, in two languages: tests/plugins/page/test_access.py."""


@cache
def shown() -> list[re.Pattern[str]]:
    """Return the texts of the page: the catalogue has all, with # for digits and {} for names."""
    keys = re.findall(r'^\s*"((?:[^"\\]|\\.)+)":', CATALOGUE.read_text(), re.MULTILINE)
    assert len(keys) > 500
    return [re.compile(re.escape(key).replace(r"\#", r"\d+").replace(r"\{\}", ".+"), re.IGNORECASE) for key in keys]


def labels() -> list[Part]:
    """Return what the pages say to press or read: in italics, and the buttons of teach.md's table."""
    (buttons,) = re.findall(r"^\| button \|.*?\n\n", prose(DOCS / "teach.md"), re.DOTALL | re.MULTILINE)
    names = re.split(r"\n\|[ -]+\|[^\n]*\n\| |(?<=\|)\n\| ", buttons)[1:]
    column = [Part(DOCS / "teach.md", 0, name) for row in names for name in row.split(" |")[0].split(", ")]
    return [*italics(*OF_THE_PAGE), *column]


def test_a_label_is_on_the_page() -> None:
    wrong = []
    for part in labels():
        if part.text in STRESSED | OF_THE_BROWSER | WITHOUT_SCRIPTS or part.text.endswith("on a take"):
            continue
        begins = re.escape(part.text.rstrip("… "))
        if not any(each.fullmatch(part.text) for each in shown()) and not any(
            re.match(begins, each.pattern.replace("\\", ""), re.IGNORECASE) for each in shown()
        ):
            wrong.append(f"{part}: {part.text}")
    assert wrong == []
    assert len(labels()) > 90


COMMANDS = (
    r"handsteer|signs|make|uv|python3?|pytest|ros2?|ros\w+|rqt_\w+|sudo|ssh|iw|mkdir|-+[\w.-]+|\.?[~.]\S*|\w+\(.*|<.*"
)
"""First words of what is not a message: commands, options, calls and forms."""

COMPOSED = {"steering left of an obstacle 0.46 m ahead"}
"""Of parts that are each too short: tests/nodes/test_assist.py."""

LEAST_QUOTED, LEAST_SAME = 8, 0.4
"""So many messages are quoted in sentences; of the characters of each, so many are in the source as they are."""


@cache
def messages() -> list[str]:
    """Return all texts of the sources, with a zero byte wherever a value is put in."""
    found: list[str] = []
    for path in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.JoinedStr):
                parts = (part.value if isinstance(part, ast.Constant) else "\0" for part in node.values)
                found.append("".join(map(str, parts)))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(re.sub(r"%[.\d]*[sdrfg]|\{[\w.:]*\}", "\0", node.value))
    return found


def makes(template: str, message: str) -> bool:
    """Return whether ``message`` may be made of ``template``: it has all its fixed parts in their order."""
    fixed = template.split("\0")
    if len("".join(fixed)) < LEAST_SAME * len(message) or not all(part in message for part in fixed):
        return False
    return re.search(".*".join(map(re.escape, fixed)), message) is not None


def test_a_message_in_a_sentence_is_one_of_handsteer() -> None:
    wrong, quoted = [], 0
    for part in code(*(page for page in PAGES if page.stem not in ("configuration", "faults"))):
        words = part.text.split()
        if len(words) < 4 or re.fullmatch(COMMANDS, words[0]) or part.text in COMPOSED:
            continue
        quoted += 1
        beginning, cut, _ = part.text.partition("…")
        if not any(makes(text, beginning.rstrip(" (:")) or (cut and beginning[-30:] in text) for text in messages()):
            wrong.append(f"{part}: {part.text}")
    assert wrong == []
    assert quoted >= LEAST_QUOTED


def test_a_sentence_of_an_output_is_one_of_handsteer() -> None:
    """Lines of figures, and what ROS prints, are left out."""
    wrong, shown = [], 0
    for block in blocks(""):
        if not re.search(r"^\$ handsteer|^handsteer: ", block.text, re.MULTILINE):
            continue
        for line in block.text.splitlines():
            message = line.removeprefix("handsteer: ")
            if len(re.findall(r"\b[a-z]+\b", message)) < 6:
                continue
            shown += 1
            cells = re.split(r"  +", message.strip())
            is_head = len(cells) > 2 and set(cells) <= set(messages())  # of a table
            if not is_head and not any(makes(text, message) for text in messages()):
                wrong.append(f"{block}: {line}")
    assert wrong == []
    assert shown >= 5
