from tests.plugins.page.served import Site


def test_a_page_without_a_study_says_how_to_start_one(site: Site) -> None:
    response = site.get("/study")
    assert response.status == 200
    assert "handsteer study plan.yaml" in response.read().decode()
