"""Studies with people: the plan, the order of its steps, the forms, the results, and the session of one participant.

``session`` joins plan, order, forms and results for one participant (docs/study.md).

Without page and graph, which :mod:`handsteer.plugins.page.study_page` joins it with. Imports the kernel only.
"""
