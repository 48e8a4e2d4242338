"""The site of the documentation: ``make site``. Nothing is fetched from other sites, when built or when read."""

project = "handsteer"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "furo"
html_title = project
exclude_patterns = ["images/**"]
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
autoclass_content = "class"
myst_heading_anchors = 3
# Links to sources, beside the site; types of libraries; CSV in examples.
suppress_warnings = ["myst.xref_missing", "ref.python", "misc.highlighting_failure"]
