# SPDX-FileCopyrightText: 2026 The gltf-meshlet authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Work that shows its progress and can be cancelled: in a dialog with Esc, else with Ctrl-C."""

import sys
import threading
import time

import bpy

DELAY = 1.0  # seconds until the progress is shown
PAUSE = 0.1  # seconds between two looks at it
SHOWN = 10.0  # seconds for which the result is in the status bar


class Cancelled(Exception):
    """The user has cancelled the work."""


class Job:
    """Work in a thread of its own.

    work: takes a function, which it calls with the share that is done, 0 to 1, and which raises
    Cancelled to end it.
    """

    def __init__(self, name, work):
        self.name, self.fraction = name, 0.0
        self._is_cancelled = False
        self._result = self._error = None
        self._start = time.monotonic()
        self._thread = threading.Thread(target=self._run, args=[work], daemon=True)
        self._thread.start()

    @property
    def text(self):
        """What to show; nothing in the first second."""
        if time.monotonic() - self._start < DELAY:
            return ""
        return f"Compressing {self.name}: {100 * self.fraction:.0f} %"

    def cancel(self):
        """Ends the work at its next step."""
        self._is_cancelled = True

    def is_running(self, seconds=0.0):
        """Whether it still runs after so many seconds."""
        self._thread.join(seconds)
        return self._thread.is_alive()

    def result(self):
        """What the work returns; raises what it raises. Waits for its end."""
        self._thread.join()
        if self._error is not None:
            raise self._error
        return self._result

    def _run(self, work):
        try:
            self._result = work(self._advance)
        except BaseException as error:
            self._error = error

    def _advance(self, fraction):
        if self._is_cancelled:
            raise Cancelled
        self.fraction = fraction


def wait(job, context):
    """Waits for a job and shows its progress: at the mouse, and on the terminal of a script."""
    manager, printed = context.window_manager, ""
    manager.progress_begin(0, 100)
    try:
        while job.is_running(PAUSE):
            manager.progress_update(100 * job.fraction)
            if job.text and bpy.app.background and sys.stderr.isatty():
                printed = job.text
                sys.stderr.write(f"\r{printed}")
                sys.stderr.flush()
    except KeyboardInterrupt:
        job.cancel()
    finally:
        if printed:
            sys.stderr.write("\n")
        manager.progress_end()


class GLTF_MESHLET_OT_wait(bpy.types.Operator):
    """Waits for a job while Blender draws its windows; Esc cancels it"""

    bl_idname = "wm.gltf_meshlet_wait"
    bl_label = "Compressing"
    bl_options = {"INTERNAL"}  # noqa: RUF012 (as Blender has it)

    waiting = None  # (job, function of the operator that ends it)

    def invoke(self, context, event):
        manager = context.window_manager
        self._timer = manager.event_timer_add(PAUSE, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        job, end = GLTF_MESHLET_OT_wait.waiting
        if event.type == "ESC" and event.value == "PRESS":
            job.cancel()
        if event.type != "TIMER" or job.is_running():
            text = job.text
            context.workspace.status_text_set(f"{text}   (Esc cancels)" if text else None)
            return {"RUNNING_MODAL"}
        context.window_manager.event_timer_remove(self._timer)
        show(context, end(self))
        return {"FINISHED"}


def show(context, result):
    """Shows (kind, text): the last one in the status bar for a while, errors in a pop-up.

    Blender shows reports only of operators that it has started itself, not those of Python.
    """
    errors = [text for kind, text in result if kind == "ERROR"]

    def draw(menu, _):
        for text in errors:
            menu.layout.label(text=text)

    if errors:
        context.window_manager.popup_menu(draw, title="Export glTF 2.0", icon="ERROR")
    context.workspace.status_text_set(result[-1][1])
    bpy.app.timers.register(_clear_status, first_interval=SHOWN)


def _clear_status():
    for workspace in bpy.data.workspaces:
        workspace.status_text_set(None)


def wait_in_window(job, end):
    """Returns at once; `end` is called with an operator when the job has ended.

    It returns (kind, text) of what to show.
    """
    GLTF_MESHLET_OT_wait.waiting = job, end
    bpy.ops.wm.gltf_meshlet_wait("INVOKE_DEFAULT")


def register():
    bpy.utils.register_class(GLTF_MESHLET_OT_wait)


def unregister():
    bpy.utils.unregister_class(GLTF_MESHLET_OT_wait)
