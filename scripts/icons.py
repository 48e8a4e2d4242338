"""Draws the icons of the installed page from its SVG: python scripts/icons.py."""

import chromium

from handsteer.plugins.page.elements import STATIC
from handsteer.plugins.page.page import ICON

# A launcher cuts a maskable icon to a shape of its own: full to the edges, with the drawing in the middle.
_MASKABLE = ICON.replace('rx="16" ', "").replace("<g ", '<g transform="translate(6.4 6.4) scale(0.8)" ')
_FILES = {"icon-192": (192, ICON), "icon-512": (512, ICON), "icon-full": (512, _MASKABLE)}


def main() -> None:
    """Write the files."""
    with chromium.playwright() as playwright:
        page = chromium.launch(playwright).new_page()
        for name, (size, drawing) in _FILES.items():
            page.set_viewport_size({"width": size, "height": size})
            page.set_content(f"<style>body {{ margin: 0 }} svg {{ display: block }}</style><div>{drawing}</div>")
            page.screenshot(path=STATIC / "icons" / f"{name}.png", omit_background=True)


if __name__ == "__main__":
    main()
