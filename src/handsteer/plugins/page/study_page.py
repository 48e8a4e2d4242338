"""The page ``/study``: leads one participant through a study, step by step."""

import asyncio
import html
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final

from nicegui import ui
from nicegui.events import GenericEventArguments

from handsteer.control.explain import ReasonCode
from handsteer.errors import HandsteerError, StudyError
from handsteer.nodes.status import ERROR
from handsteer.plugins.page.camera import CameraPanel
from handsteer.plugins.page.elements import box, button, card, tag, text
from handsteer.plugins.page.node import DashboardNode
from handsteer.plugins.page.page import Page, PageContext
from handsteer.plugins.page.remote_graph import RemoteGraph
from handsteer.plugins.page.state import PageState
from handsteer.plugins.page.steer_panel import SteerPanel
from handsteer.plugins.page.world_panel import WorldPanel
from handsteer.plugins.study.forms import FORMS, Form, Item
from handsteer.plugins.study.order import Step
from handsteer.plugins.study.plan import FormName
from handsteer.plugins.study.session import Outcome, Session
from handsteer.types import stopwatch

_NONE: Final = "No study runs here: start one with handsteer study plan.yaml --participant P01."
_WATCHED: Final = "Another viewer drives, and leads this study: ask to drive first."
_LOST: Final = "Another viewer drives now: the lap does not count, and is to be driven again."
_STANDS: Final = "the robot stands until a lap begins"
_STEER: Final = "nothing steers the robot"
# Not those of the hand as a joystick, which is off where another input is studied.
_OF_THE_HAND: Final = frozenset[ReasonCode](
    ("disarmed", "disengaged", "renew", "no_image", "no_input", "no_sign", "stop_sign", "not_started")
)
_SLOW: Final = "The robot does not answer: try again."
# The 3D view measures itself when the window is resized, and only then.
_RESIZED: Final = "setTimeout(() => window.dispatchEvent(new Event('resize')), 100)"
_ANSWER_TIMEOUT_S: Final = 5.0


class StudyPage(Page):
    """Leads a participant; only the driver's page does."""

    def __init__(self, context: PageContext) -> None:
        styles = ("drive.css", "steer.css", "world.css", "study.css")
        super().__init__(context, "/study", *styles, "steer.js", "sticks.js")
        self._session = context.study
        if context.study is None or context.graph is None:
            with card("Study", "study panel"):
                ui.label(_NONE)
            return
        self._graph: RemoteGraph = context.graph
        self._begins = False
        with box("desk") as self._desk:
            with box("side"):
                self._card = _StudyCard(context.study, self)
                self._camera = CameraPanel(self, context.graph)
                self._steering = SteerPanel(self)
            self._world = WorldPanel(self, context.graph)
        self._classes = ""
        self.client.on_disconnect(self._abandon)

    def show(self, node: DashboardNode, state: PageState) -> None:
        """Show changes, and follow the lap in progress if it is this viewer's."""
        session = self._session
        is_over = session is not None and (session.lap is None or session.lap.course is None)
        # Between laps nothing is wrong, and there is nothing to reset.
        calm = replace(state, mood="standing", headline="Standing", reason=_STANDS, stopped=False)
        super().show(node, calm if is_over and state.stopped else self._of_the_input(state))
        if session is None:
            return
        self._follow(session, node, state)
        self._show_desk(session)
        self._card.update()
        self._camera.update(state)
        self._world.update(state, node.world)
        self._steering.update(state, self.lease(node))

    def lead(self, action: Callable[[], object]) -> None:
        """Call ``action``, which changes the session, if this viewer drives; show an error."""
        self._card.message = ""
        if not self.drives():
            self._card.message = _WATCHED
            return
        try:
            action()
        except StudyError as error:
            self._card.message = f"{error}."

    async def begin(self) -> None:
        """Put the robot to the start of the course, and begin the lap."""
        session, node = self._session, self.node
        if session is None or node is None or self._begins or session.lap is not None or session.step.kind != "lap":
            return
        if not self.drives():
            self._card.message = _WATCHED
            return
        self._begins, self._card.message = True, ""
        node.halt(self.client.id, "the lap")
        try:
            if self._graph.config != session.config:
                await asyncio.to_thread(self._graph.reconfigure, session.config)
            entered = asyncio.wrap_future(self._graph.enter_world(session.world))
            await asyncio.wait_for(entered, _ANSWER_TIMEOUT_S)
        except TimeoutError:
            self._card.message = _SLOW
        except HandsteerError as error:
            self._card.message = f"{error}."
        else:
            if self.node is not None and self.drives():  # the viewer may have left
                session.begin_lap(self.client.id, node.clock.now())
        finally:
            self._begins = False

    def end(self, outcome: Outcome) -> None:
        """Stop the robot and end the lap, if there is one."""
        self._graph.steering.halt()
        if self._session is not None:
            try:
                self._session.end_lap(outcome)
            except StudyError as error:
                self._card.message = f"{error}."

    def _follow(self, session: Session, node: DashboardNode, state: PageState) -> None:
        """Take the referee's report on the lap; end one whose viewer no longer drives."""
        lap, is_driver = session.lap, self.lease(node).role == "driver"
        if lap is None or not (is_driver or lap.viewer == self.client.id):
            return
        if not is_driver or lap.viewer != self.client.id:
            self.end("repeated")
            self._card.message = self._card.message or _LOST
            return
        self.lead(lambda: session.note(state.robot.course, state.robot.path_length_m, node.clock.now()))
        if session.lap is None:
            node.halt(self.client.id, "the lap")
        elif lap.course is None and session.lap.course is not None:
            node.reset(self.client.id)

    def _reset(self) -> None:
        session = self._session
        if session is not None and (session.lap is None or session.lap.course is None):
            self._card.message = f"{_STANDS.capitalize()}."
        else:
            self.do(DashboardNode.reset)

    def _abandon(self) -> None:
        """End the lap of a viewer whose connection is lost."""
        if self._session is not None and self._session.lap and self._session.lap.viewer == self.client.id:
            self.end("repeated")

    def _of_the_input(self, state: PageState) -> PageState:
        """Return ``state`` without why the hand does not move the robot, where another input is studied."""
        return state if self._session is None or _method(self._session) == "hand" else without_hand(state)

    def _show_desk(self, session: Session) -> None:
        """Show the inputs of the step's condition only, and none while questions are asked."""
        step, method = session.step, _method(session)
        classes = f"{'driving' if step.kind == 'lap' else 'asking'} by-{method}"
        # For the scripts of inputs that cannot be hidden.
        classes += "".join(f" no-{each}" for each in ("keys", "gamepad") if each != method or step.kind != "lap")
        if classes != self._classes:
            self._desk.classes(remove=self._classes, add=classes)
            self._classes = classes
            self.client.run_javascript(_RESIZED)


def _method(session: Session) -> str:
    """Return the input of the step's condition."""
    condition = session.step.condition
    return session.task.plan.condition(condition).input if condition else "hand"


def without_hand(state: PageState) -> PageState:
    """Return ``state`` as it is to one who steers otherwise: without reasons that lie with the hand or its camera."""
    reason = state.control.reason
    is_of_the_hand = reason is not None and reason.code in _OF_THE_HAND and state.robot.level < ERROR
    if not is_of_the_hand or state.viewers.waits or state.viewers.topic:
        return state
    headline = state.headline if state.headline == "Stopping" else "Standing"
    return replace(state, mood="standing", headline=headline, reason=_STEER)


class _StudyCard:
    """The current step, and in ``message`` what went wrong, or nothing."""

    def __init__(self, session: Session, page: StudyPage) -> None:
        self._session, self._page = session, page
        self._shown: tuple[Step, bool] | None = None
        self.message = ""
        self._answers: dict[str, int] = {}
        with card(session.task.plan.title, "study panel"):
            self._progress = text("faint", "")
            self._body = box("body").props('aria-live="polite"')
            self._status = text("status", "")
            self._message = text("trouble", "").props('role="alert"')

    def update(self) -> None:
        """Show changes."""
        session = self._session
        shown = (session.step, session.lap is not None)
        if shown != self._shown:
            self._shown = shown
            self._fill(session.step)
        done, all_steps = session.progress
        self._progress.set_text(f"{session.task.participant}: {done} of {all_steps} done")
        self._status.set_text(self._lap_status() if session.step.kind == "lap" else "")
        self._message.set_text(self.message)

    def _fill(self, step: Step) -> None:
        self._body.clear()
        plan, session, lead = self._session.task.plan, self._session, self._page.lead
        with self._body:
            if step.kind == "consent":
                text("words", plan.welcome)
                self._button("I agree", lambda: lead(session.agree))
            elif step.kind == "instructions":
                self._title(step)
                text("words", plan.condition(step.condition).instructions)
                self._button("Continue", lambda: lead(session.go_on))
            elif step.kind == "lap":
                self._fill_lap(step)
            elif step.form:
                self._fill_form(step.form)
            else:
                text("words", plan.thanks)

    def _fill_lap(self, step: Step) -> None:
        plan, page = self._session.task.plan, self._page
        kind, count = ("Practice lap", plan.practice_laps) if step.practice else ("Lap", plan.laps)
        self._title(step)
        text("words", plan.condition(step.condition).instructions)
        course = f", course {plan.courses.index(step.course) + 1}" if len(plan.courses) > 1 else ""
        tag("h3", "", f"{kind} {step.lap} of {count}{course}")
        if self._session.lap is None:
            self._button("Begin lap", page.begin)
            return
        with box("buttons"):
            button("Give up", lambda: page.lead(lambda: page.end("given_up")), "Give up: the lap ends, and counts")
            again = "Drive again: the lap does not count, because something else went wrong"
            button("Drive again", lambda: page.lead(lambda: page.end("repeated")), again)

    def _fill_form(self, name: FormName) -> None:
        form = FORMS[name]
        self._answers = {}
        tag("h3", "", form.title)
        with box(f"questions {name}") as questions:
            for number, item in enumerate(form.items, 1):
                ui.html(_question(number, item, form), sanitize=False)
        questions.on("change", self._take_answer, js_handler="(event) => emit(event.target.name, event.target.value)")
        self._button("Send", lambda: self._page.lead(lambda: self._session.submit(self._answers)))

    def _take_answer(self, event: GenericEventArguments) -> None:
        # A browser may send anything; the session checks the answers.
        match event.args:
            case [str(name), str(value)] if value.isdecimal() and len(value) <= 3 and len(self._answers) <= 20:
                self._answers[name] = int(value)

    def _lap_status(self) -> str:
        lap = self._session.lap
        if lap is None:
            return _result(self._session.last)
        if lap.course is None:
            return "The robot is put to the start."
        left_s = max(0.0, self._session.task.plan.lap_limit - lap.course.time_s)
        if lap.course.phase == "ready":
            return "Drive through the yellow gate when you like: the time begins there."
        return f"{stopwatch(left_s)} left"

    def _title(self, step: Step) -> None:
        tag("h3", "part", f"Part {step.order} of {len(self._session.task.plan.conditions)}")

    def _button(self, words: str, on_click: Callable[[], object]) -> None:
        with box("buttons"):
            button(words, on_click).classes("primary")


_OUTCOMES: Final = {
    "finished": "finished",
    "limit": "ended, as the time was over",
    "given_up": "given up",
    "repeated": "not counted",
}


def _result(row: Mapping[str, object] | None) -> str:
    if row is None:
        return ""
    figures = f"gates {row['passed']}/{row['gates']}, bumps {row['bumps']}, {row['time_s']:.1f} s"
    return f"The lap before was {_OUTCOMES[str(row['outcome'])]}: {figures}"


def _question(number: int, item: Item, form: Form) -> str:
    """Return a question as HTML: a group of radio buttons between its ends, without an answer chosen."""
    title = f"<b>{html.escape(item.title)}</b> " if item.title else ""
    low, high = (html.escape(end) for end in item.ends)
    inputs = "".join(
        f'<input type="radio" name="{item.name}" value="{value}" aria-label="{value}, '
        f'from {form.answers[0]}: {low}, to {form.answers[-1]}: {high}">'
        for value in form.answers
    )
    return (
        f"<fieldset><legend>{number}. {title}{html.escape(item.question)}</legend>"
        f'<div class="marks">{inputs}</div><div class="ends"><span>{low}</span><span>{high}</span></div></fieldset>'
    )
