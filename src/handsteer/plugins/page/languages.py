"""The language in which a browser shows the page."""

from typing import Final

from handsteer.plugins.page.elements import STATIC

# The server writes English everywhere. For a browser that prefers another language of static/languages, the script
# static/translate.js replaces the words where they are shown, by that catalogue.
ENGLISH: Final = "en"
LANGUAGES: Final = frozenset({ENGLISH, *(file.stem for file in (STATIC / "languages").glob("*.js"))})
"""Two-letter codes (ISO 639-1)."""

_LONGEST_HEADER: Final = 500


def preferred_language(accept: str) -> str:
    """Return the language of the page that a browser wants most; English if it wants none of them.

    ``accept`` is its ``Accept-Language`` header (RFC 9110, section 12.5.4), for example ``de-CH, de;q=0.9, en;q=0.8``.
    """
    wanted: dict[str, float] = {}
    for item in accept[:_LONGEST_HEADER].split(","):
        name, _, weight = item.partition(";")
        language = name.strip().partition("-")[0].lower()
        if language in LANGUAGES:
            wanted[language] = max(_weight(weight), wanted.get(language, 0.0))
    best = max(wanted, key=wanted.__getitem__, default=ENGLISH)  # the first of equals
    return best if wanted.get(best, 0.0) > 0.0 else ENGLISH


def _weight(parameter: str) -> float:
    name, _, value = parameter.strip().partition("=")
    if name.strip().lower() != "q":
        return 1.0
    try:
        return float(value)
    except ValueError:
        return 0.0
