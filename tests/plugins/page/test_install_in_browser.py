"""Whether Chromium would install the page as an app, and that the token is in nothing that an app keeps."""

import json

from tests.plugins.page.browsers import a_browser
from tests.plugins.page.served import Site
from tests.plugins.page.visits import NEEDS_A_BROWSER

pytestmark = NEEDS_A_BROWSER

# Pages of a test have no profile, into which nothing can be installed.
NO_PROFILE = {"in-incognito"}


def test_chromium_can_install_the_page_and_the_manifest_has_no_token() -> None:
    site = Site(token="always")
    try:
        with a_browser() as browser:
            page = browser.new_page()
            page.goto(site.url)
            page.locator(".banner").wait_for()
            session = page.context.new_cdp_session(page)
            errors = {each["errorId"] for each in session.send("Page.getInstallabilityErrors")["installabilityErrors"]}
            found = session.send("Page.getAppManifest")
            icon = page.request.get(f"{page.url.rstrip('/')}/assets/icons/icon-192.png")
            assert errors <= NO_PROFILE
            assert found["errors"] == []
            manifest = json.loads(found["data"])
            assert (manifest["start_url"], manifest["display"]) == ("/", "standalone")
            assert "token" not in found["data"] + found["url"]
            assert icon.headers["content-type"] == "image/png"
    finally:
        site.close()
