"""The choice of a page's language, and the catalogues in ``static/languages``: complete and well-formed."""

import json
import re
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handsteer.parameters import section_model
from handsteer.plugins.page.elements import STATIC
from handsteer.plugins.page.languages import LANGUAGES, preferred_language
from handsteer.plugins.page.settings_fields import FIELDS, SECTION_TITLES
from handsteer.plugins.teach.effects import EFFECTS
from handsteer.robots.world import load_world, shipped_worlds
from handsteer.types import SIGNS

OTHERS = sorted(LANGUAGES - {"en"})
PLACE = re.compile(r"\{\}|#")


@cache
def catalogue(language: str) -> dict[str, str]:
    lines = (STATIC / "languages" / f"{language}.js").read_text(encoding="utf-8").splitlines()
    content = "\n".join(line for line in lines if not line.strip().startswith("//"))
    pairs = json.loads(content.removeprefix("const WORDS = ").removesuffix(";"), object_pairs_hook=list)
    keys = [key[:1].lower() + key[1:] for key, _ in pairs]
    assert len(set(keys)) == len(keys), [key for key in keys if keys.count(key) > 1]
    return dict(pairs)


def is_known(words: str, language: str) -> bool:
    """Return whether ``words``, without names in them, are translated."""
    key = re.sub(r"(?<![^\W_])[+-]?\d+(\.\d+)?", "#", words)
    return any(form in catalogue(language) for form in (key, key[:1].lower() + key[1:], key[:1].upper() + key[1:]))


@pytest.mark.parametrize(
    ("accept", "language"),
    [
        ("", "en"),
        ("en-US,en;q=0.9", "en"),
        ("de-DE,de;q=0.9,en;q=0.8", "de"),
        ("de-CH", "de"),
        ("DE", "de"),
        ("en;q=0.5, de;q=0.8", "de"),
        ("en, de", "en"),
        ("fr, de;q=0.3, en;q=0.2", "de"),
        ("ja", "en"),
        ("de;q=0", "en"),
        ("de;q=much", "en"),
        ("*", "en"),
    ],
)
def test_the_language_that_the_browser_wants_most_is_chosen(accept: str, language: str) -> None:
    assert preferred_language(accept) == language


@given(st.text(max_size=800))
def test_any_header_gives_a_language_that_there_is(accept: str) -> None:
    assert preferred_language(accept) in LANGUAGES


@pytest.mark.parametrize("language", OTHERS)
def test_a_translation_has_the_places_of_its_key_in_the_same_order(language: str) -> None:
    for key, words in catalogue(language).items():
        assert words, key
        assert PLACE.findall(words.replace("{=}", "{}")) == PLACE.findall(key), key
        assert not re.search(r"\d", re.sub(r"[^\W\d_]+\d+", "", key)), f"{key}: numbers are written as #"


@pytest.mark.parametrize("language", OTHERS)
def test_parameters_signs_and_effects_are_translated(language: str) -> None:
    shown = [f"{field.text}." for field in FIELDS.values()]
    shown += [field.title for field in FIELDS.values()]
    shown += [*SECTION_TITLES.values(), *SIGNS, *EFFECTS.values()]
    shown += sorted({(section_model(field.section).__doc__ or "").partition("\n")[0] for field in FIELDS.values()})
    assert [words for words in shown if not is_known(words, language)] == []


@pytest.mark.parametrize("language", OTHERS)
@pytest.mark.parametrize("world", shipped_worlds())
def test_the_names_of_shipped_worlds_and_of_what_is_in_them_are_translated(world: str, language: str) -> None:
    found = load_world(world)
    names = {world, *(thing.name for thing in found.obstacles), *(gate.name for gate in found.gates)}
    assert {name for name in names if not is_known(name, language)} == set()
