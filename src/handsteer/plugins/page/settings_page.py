"""The page ``/settings``: every parameter, its meaning, and its value."""

from collections.abc import Callable, Iterator

from nicegui import ui

from handsteer.parameters import section_model
from handsteer.plugins.page.elements import box, button, identifier, set_property, switch, tag, text
from handsteer.plugins.page.node import DashboardNode
from handsteer.plugins.page.page import Page, PageContext
from handsteer.plugins.page.settings import Settings
from handsteer.plugins.page.settings_fields import COMMON, FIELDS, FORM, SECTION_TITLES, Field
from handsteer.plugins.page.settings_row import Row
from handsteer.plugins.page.state import PageState

_LONGEST_SEARCH = 100
_OPEN = frozenset({"common", "camera", "signs", "control"})
"""Groups that are unfolded at first."""
_ELSEWHERE = (
    "There are no settings here: this process only serves the page. Each node has its own, where it runs; "
    "`ros2 param list` and `ros2 param set` show and set them in ROS 2, `handsteer NODE --config FILE` reads them at "
    "its start."
)


class SettingsPage(Page):
    """Sets all parameters; viewers who do not drive can read them."""

    title = "Settings"

    def __init__(self, context: PageContext) -> None:
        super().__init__(context, "/settings", "settings.css", "settings.js")
        self._panel: SettingsPanel | None = None
        if context.settings is None:
            with ui.element("section").classes("card panel"):
                text("elsewhere", _ELSEWHERE)
        else:
            self._panel = SettingsPanel(context.settings, self)

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show changes."""
        super().show(node, state)
        if self._panel is not None:
            role = self.lease(node).role
            self._panel.update(to_driver=role == "driver", editable=role != "watcher")


class SettingsPanel:
    """All parameters, with a search, and buttons to load and save the file."""

    def __init__(self, settings: Settings, page: Page) -> None:
        self._settings, self._page = settings, page
        self._shown: tuple[object, ...] = ()
        self._groups: list[_Group] = []
        page.client.on_delete(self._groups.clear)  # rows refer to this panel
        self._toolbar()
        with box("settings"):
            # Unfolded by settings.js on wide screens.
            with ui.element("details").classes("index"):
                tag("summary", "", "Sections")
                index = ui.element("nav").props('aria-label="Sections"')
            with box("sections"):
                common = tuple(FIELDS[path] for path in COMMON)
                self._group("common", "Common", "The parameters that are changed most.", common, index)
                for section, fields in FORM.items():
                    meaning = (section_model(section).__doc__ or "").partition("\n")[0]
                    rest = tuple(field for field in fields if field.path not in COMMON)
                    self._group(section, SECTION_TITLES[section], meaning, rest, index)
                self._nothing = text("nothing hidden", "No parameter has this in its name or description.")
        # As most viewers see it, so that the page is complete when it is served; changes follow.
        self.update(to_driver=False, editable=True)

    def update(self, *, to_driver: bool, editable: bool) -> None:
        """Show the values; they are ``editable`` if this viewer drives (``to_driver``) or the lease is free."""
        settings = self._settings
        settings.follow()
        shown = (settings.revision, to_driver, editable)
        for row in self._rows():
            if shown != self._shown or row.is_due:
                row.update(to_driver=to_driver, editable=editable)
        if shown == self._shown:
            return
        self._shown = shown
        file = settings.file
        path = file.path if to_driver else file.path.name
        command = file.start_command if to_driver else "handsteer run"
        self._place.set_text(f"The file is {path}; the next start reads it by: {command}")
        saved = "as in the file" if settings.file.is_read else "all is as by default"
        self._state.set_text(saved if settings.is_saved else "not saved yet")
        for each in (self._save, self._load, self._reset):
            switch(each, "hidden", on=not editable)
        self._filter()

    def _toolbar(self) -> None:
        with ui.dialog() as dialog, box("card panel question"):
            text("", "Set all parameters to their defaults? The file stays as it is until you save.")
            with box("row"):
                button("Set all to default", dialog.close).on("click", self._reset_all)
                button("Keep", dialog.close)
        with ui.element("section").classes("card panel tools"):
            with box("row"):
                self._search = ui.input(placeholder="Search", on_change=self._filter).classes("search")
                self._search.props('outlined dense clearable type="search" aria-label="Search the parameters"')
                self._only = ui.switch("changed only", on_change=self._filter)
                self._state = text("state", "")
                self._save = button("Save", self._save_file).classes("save")
                self._load = button("Load", self._load_file, "Load what the file says")
                self._reset = button("Reset all", dialog.open, "Set all parameters to their defaults")
            self._place = text("place", "")
            self._message = text("said", "").props('role="status"')

    def _change(self, change: Callable[[], object], done: str = "") -> str:
        """Make a change if this viewer may, and show ``done`` or the error message; return the latter."""
        error = self._page.change(change, "only the driver can change settings: ask to drive first")
        self._message.set_text(error or done)
        switch(self._message, "wrong", on=bool(error))
        return error

    def _save_file(self) -> None:
        # A browser may send the click before it sends that the field, with what was just entered, is left.
        if any(row.take() for row in self._rows()):
            return
        done: list[str] = []
        if not self._change(lambda: done.append(self._settings.save())):
            self._message.set_text(done[0])

    def _load_file(self) -> None:
        self._drop_edits()
        self._change(self._settings.load, f"loaded {self._settings.file.path.name}")

    def _reset_all(self) -> None:
        self._drop_edits()
        self._change(
            lambda: self._settings.reset(*(row.field for row in self._rows())), "all is as by default; not saved"
        )

    def _drop_edits(self) -> None:
        for row in self._rows():
            row.drop()

    def _group(self, name: str, title: str, meaning: str, fields: tuple[Field, ...], index: ui.element) -> None:
        with index:
            link = ui.link(title, f"#{name}")
        self._groups.append(_Group(name, title, meaning, link))
        with self._groups[-1].body:
            if len(fields) < len(FORM.get(name, ())):
                ui.link("Some parameters of this section are under Common.", "#common").classes("elsewhere")
            self._groups[-1].rows += [Row(field, self._settings, self._change) for field in fields]

    def _rows(self) -> Iterator[Row]:
        return (row for group in self._groups for row in group.rows)

    def _filter(self) -> None:
        words = self._search.value[:_LONGEST_SEARCH] if isinstance(self._search.value, str) else ""
        found = 0
        for row in self._rows():
            is_wanted = row.field.matches(words) and (not self._only.value or self._settings.is_changed(row.field))
            switch(row.element, "hidden", on=not is_wanted)
            row.is_found = is_wanted
            found += is_wanted
        for group in self._groups:
            group.update(self._settings, searched=bool(words.strip() or self._only.value))
        switch(self._nothing, "hidden", on=found > 0)


class _Group:
    """A card of rows that can be folded, and its link in the index.

    Args:
        name: The section's name in the file, or ``common``; the anchor that the link leads to.
    """

    def __init__(self, name: str, title: str, meaning: str, link: ui.link) -> None:
        self.rows: list[Row] = []
        self._link = link
        self._is_open = name in _OPEN
        with ui.element("details").classes("card panel section").props(f'id="{name}"') as self._card:
            with ui.element("summary"):
                tag("h2", "", title)
                if name in FORM:
                    identifier("raw", name)
                self._changed = text("mark", "")
                text("meaning", meaning)
            self.body = box("rows")
        with link:
            self._count = tag("span", "count", "")

    def update(self, settings: Settings, *, searched: bool) -> None:
        """Show how many values differ from the default; while ``searched``, unfold it if it has a row to show."""
        count = sum(settings.is_changed(row.field) for row in self.rows)
        self._changed.set_text(f"{count} changed" if count else "")
        self._count.set_text(str(count or ""))
        is_found = any(row.is_found for row in self.rows)
        switch(self._card, "hidden", on=not is_found)
        switch(self._link, "hidden", on=not is_found)
        set_property(self._card, "open", is_found if searched else self._is_open)
