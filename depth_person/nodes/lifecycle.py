"""The life of a node: configured, active, silent, gone; and the threads that live with it."""
from __future__ import annotations

from collections.abc import Callable
import threading
import traceback
from typing import Any, TypeVar

from rclpy.lifecycle import LifecycleNode, LifecycleState
from rclpy.lifecycle import TransitionCallbackReturn as Outcome

from depth_person.errors import DepthPersonError
from depth_person.nodes.monitor import Level, Monitor
from depth_person.nodes.worker import Mailbox, Worker

_UNCONFIGURED = 'unconfigured; nothing is computed until it is configured and activated'
_INACTIVE = 'inactive; nothing is computed or published until it is activated'
_FINALIZED = 'shut down; start the node again to have it back'

Item = TypeVar('Item')


class ManagedNode(LifecycleNode):
    """
    A lifecycle node whose subclasses say what belongs to each state.

    A transition that fails leaves the node in the state before it, with the reason in the
    diagnostics and the log.

    :ivar monitor: what the diagnostics say.
    """

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        self.monitor = Monitor(self._log)
        self.monitor.set_state(Level.WARN, _UNCONFIGURED)
        self._active = False
        self._configured = False
        self._failure: Exception | None = None
        self._jobs: list[tuple[str, Callable[[threading.Event], None]]] = []
        self._mailboxes: list[Mailbox[Any]] = []
        self._workers: list[Worker] = []
        self._permanent: set[object] = set()
        self._answer_change = self._service_change_state.callback
        self._service_change_state.callback = self._change_state_if_possible

    @property
    def active(self) -> bool:
        """Whether the node works; what comes while it does not is to be passed over."""
        return self._active

    @property
    def configured(self) -> bool:
        """Whether the node has what it works with."""
        return self._configured

    def configure(self) -> None:
        """
        Make what the node works with: publishers, inputs, networks, jobs.

        :raises DepthPersonError: when that is not possible; the node then stays unconfigured.
        """

    def activate(self) -> None:
        """Drop what is left of an earlier time; called before the jobs start."""

    def deactivate(self) -> None:
        """Wake the jobs that wait for something; they have been told to stop."""

    def cleanup(self) -> None:
        """Let go of what configure made; ROS entities go by themselves."""

    def work(self, name: str, target: Callable[[threading.Event], None]) -> None:
        """
        Add a job: a thread that runs while the node is active.

        :param target: returns when the event that it is given is set; called anew, with another
            event, at each activation.
        """
        self._jobs.append((name, target))

    def consume(self, name: str, handle: Callable[[Item], None]) -> Mailbox[Item]:
        """Return a mailbox; a job calls `handle` for what is put in while the node is active."""
        mailbox: Mailbox[Item] = Mailbox()

        def run(_: threading.Event) -> None:
            while (item := mailbox.take()) is not None:
                handle(item)

        self._mailboxes.append(mailbox)
        self.work(name, run)
        return mailbox

    def bring_up(self) -> None:
        """Configure and activate; raise what stands against it."""
        for trigger in (self.trigger_configure, self.trigger_activate):
            if trigger() != Outcome.SUCCESS:
                assert self._failure is not None
                raise self._failure

    def raise_failure(self) -> None:
        """Raise what ended a thread before its time."""
        for worker in self._workers:
            if worker.failure is not None:
                raise worker.failure

    def on_configure(self, state: LifecycleState) -> Outcome:
        """Make everything; stay unconfigured, with nothing left over, if something fails."""
        self._permanent = set(self._entities())
        if self._fails(self.configure):
            self._tear_down()
            return Outcome.FAILURE
        self._configured = True
        self.monitor.keep()  # they are of what was made, and stay true while it is inactive
        self.monitor.set_state(Level.WARN, _INACTIVE)
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> Outcome:
        """Start the jobs, with nothing that was left from before."""
        if self._fails(self._join) or self._fails(self.activate):
            return Outcome.FAILURE
        for mailbox in self._mailboxes:
            mailbox.open()
        self.monitor.set_state(Level.OK, '')
        result = super().on_activate(state)
        self._active = True
        self._workers = [Worker(name, target) for name, target in self._jobs]
        for worker in self._workers:
            worker.start()
        return result

    def on_deactivate(self, state: LifecycleState) -> Outcome:
        """Silence the publishers at once, then tell the jobs; they are joined later."""
        result = super().on_deactivate(state)
        self._halt()
        self.monitor.set_state(Level.WARN, _INACTIVE)
        return result

    def on_cleanup(self, state: LifecycleState) -> Outcome:
        """Let go of everything."""
        self._tear_down()
        self.monitor.set_state(Level.WARN, _UNCONFIGURED)
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> Outcome:
        """Silence the publishers, and let go of everything."""
        super().on_deactivate(state)
        self._tear_down()
        self.monitor.set_state(Level.WARN, _FINALIZED)
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> Outcome:
        """Go back to unconfigured."""
        super().on_deactivate(state)
        self._tear_down()
        self.monitor.set_state(Level.WARN, _UNCONFIGURED)
        return super().on_error(state)

    def fail(self, error: Exception) -> None:
        """Say what keeps the node from working."""
        self.monitor.set_state(Level.ERROR, str(error))
        self._log(Level.ERROR, str(error))

    def stop_jobs(self) -> None:
        """End the jobs; publishers stay as they are."""
        self._halt()
        for worker in self._workers:
            if not worker.stop():
                self.get_logger().warning(f'the thread {worker.name} does not end; leaving it')

    def _halt(self) -> None:
        """Tell the jobs to stop."""
        was_active, self._active = self._active, False
        for mailbox in self._mailboxes:
            mailbox.close()
        for worker in self._workers:
            worker.stopping.set()
        if was_active:
            self.deactivate()
            self.monitor.forget()

    def _join(self) -> None:
        """Wait for the jobs of before, of which nothing may come any more."""
        for worker in self._workers:
            if not worker.stop():
                raise DepthPersonError(
                    f'the thread {worker.name} of before still waits for its device or network; '
                    'try again in a few seconds')

    def _fails(self, step: Callable[[], None]) -> bool:
        try:
            step()
        except Exception as error:  # rclpy would turn it into an error state without a word
            self._failure = error
            if not isinstance(error, DepthPersonError):
                self.get_logger().error(traceback.format_exc())
            self.fail(error)
            return True
        return False

    def _tear_down(self) -> None:
        self._configured = False
        self.stop_jobs()
        self.cleanup()
        self._jobs, self._mailboxes, self._workers = [], [], []
        for entity, destroy in self._entities().items():
            if entity not in self._permanent:
                destroy(entity)
        self._managed_entities.clear()

    def _entities(self) -> dict[Any, Callable[[Any], bool]]:
        kinds = (
            (self.publishers, self.destroy_publisher),
            (self.subscriptions, self.destroy_subscription),
            (self.services, self.destroy_service), (self.clients, self.destroy_client),
            (self.timers, self.destroy_timer))
        return {entity: destroy for entities, destroy in kinds for entity in entities}

    def _change_state_if_possible(self, request: Any, response: Any) -> Any:
        """Refuse a transition that the state does not have; rclpy would end the process."""
        possible = {number: label for number, label, *_ in
                    self._state_machine.available_transitions}
        wanted = request.transition
        if wanted.label in possible.values() if wanted.label else wanted.id in possible:
            return self._answer_change(request, response)
        labels = ', '.join(possible.values())
        self.get_logger().warning(
            f'there is no transition {wanted.label or wanted.id} from the state '
            f'{self._state_machine.current_state[1]}; there are: {labels}')
        response.success = False
        return response

    def _log(self, level: Level, message: str) -> None:
        if level == Level.ERROR:
            self.get_logger().error(message)
        else:
            self.get_logger().warning(message)
