"""The web page, in a process of its own with ``handsteer run``.

It is made with NiceGUI. ``server`` is the web server, ``access`` its access control, ``limits`` what clients may cost
it, ``closed_pages`` frees pages and searches for garbage while the robot stands, ``socket_events`` the check of what
they send. ``node`` subscribes once for all viewers, ``observed`` is what it has received, ``state`` computes what the
page shows and ``world_state`` what the 3D view (``scene``) does, whose robot ``urdf`` reads. ``viewers`` has the
control lease, runs nodes that only pages need while there are viewers, and names viewers for the audit; each viewer
receives updates ten times a second. ``page`` is what all pages share, with ``status_bar`` at its top and the basic
``elements``; ``drive_page``, ``world_page``, ``lesson_page``, ``settings_page`` and ``study_page`` are the pages,
``camera``, ``camera_choices``, ``steer_panel``, ``legend``, ``world_panel``, ``world_editor``, ``lesson_panels`` and
``lesson_cards`` their larger cards. ``world_desk`` changes the world, with undo; ``world_plan`` shows it from above.
``lessons`` runs lessons, ``lesson_state`` describes them, ``lesson_files`` serves and receives their files,
``sign_pictures`` draws hands and shows how to hold them, ``pictures`` gives viewers the camera's, ``settings`` changes
and saves parameters, ``recordings`` serves files and reports. The browser's code is in ``static``, with uPlot for the
plots; there ``translate.js`` shows the page in the language that ``languages`` chooses. ``handsteer run`` serves the
page from a separate process, which ``page_process`` starts. There, a ``remote_graph`` stands for the graph:
``transports/piped`` carries its topics, and the same pipe requests to it. So nothing on the page can delay a command.

Imports the kernel, and :mod:`~handsteer.plugins.study`, :mod:`~handsteer.plugins.teach` and
:mod:`~handsteer.plugins.virtual_hand`, whose pages and pictures it has.
"""

# First, also in the process of its own: it loads the parameters of plug-ins, whose modules may import any other.
import handsteer.config  # noqa: F401
