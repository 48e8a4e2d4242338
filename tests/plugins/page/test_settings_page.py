from tests.plugins.page.served import Site


def test_a_page_of_other_processes_says_where_their_settings_are(site: Site) -> None:
    response = site.get("/settings")
    text = response.read().decode()
    assert response.status == 200
    assert "Each node has its own" in text
    assert "Set all to default" not in text
