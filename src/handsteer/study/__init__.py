"""Studies with people: the plan, the order of its steps, the forms, the results, and the session of one participant.

Pure, without page and graph, which :mod:`handsteer.dashboard.study_page` joins it with.
"""
