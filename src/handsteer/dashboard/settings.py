"""The page ``/settings``: every parameter, its meaning, and its value."""

from nicegui import ui

from handsteer.dashboard.node import DashboardNode
from handsteer.dashboard.page import ASSETS_PATH, Page, PageContext
from handsteer.dashboard.panels.elements import text
from handsteer.dashboard.panels.settings import SettingsPanel
from handsteer.dashboard.state import PageState

_ELSEWHERE = (
    "Here are no settings: this process only serves the page. Each node has its own, where it runs; `ros2 param list` "
    "and `ros2 param set` show and set them in ROS 2, `handsteer NODE --config FILE` reads them at its start."
)


class SettingsPage(Page):
    """Sets all parameters; viewers who do not drive can read them."""

    def __init__(self, served: PageContext) -> None:
        super().__init__(served, "/settings")
        ui.add_head_html(f'<link rel="stylesheet" href="{ASSETS_PATH}/settings.css">')
        self._panel: SettingsPanel | None = None
        if served.local.settings is None:
            with ui.element("section").classes("card panel"):
                text("elsewhere", _ELSEWHERE)
        else:
            self._panel = SettingsPanel(served.local.settings, self.drives)

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show changes."""
        super().show(node, state)
        if self._panel is not None:
            role = self.place(node).role
            self._panel.update(to_driver=role == "driver", editable=role != "watcher")
