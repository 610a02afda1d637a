# SPDX-License-Identifier: GPL-3.0-or-later
"""The rendered viewport: shows the newest picture there is, and never waits for the next.

Each 3D view has a View. All views of one scene and view layer share one native scene; a view that
hides objects of its own (local view) has another. Blender tells of changes; they are exported when
a picture is begun, so that many changes in a row cost one export. A change is followed by a look:
a picture as rough as it must be to be there at once. When nothing changed for a moment, finer ones
follow, and the last gathers samples. While a picture is under way a timer asks for it; when all
is shown nothing runs any more.
"""

import time
import traceback
import weakref
from typing import NamedTuple

import bpy
import numpy as np

from . import compat, framing, native, session, trace
from .export import changes, scene
from .pace import STEP_FACTOR, Pace, SceneQuality
from .properties import native_settings

# How often pictures under way are asked for, in seconds.
POLL_S = 0.01
# What is at rest: nothing changed for so long. Finer lattices are begun later than finer pixels,
# since a change that comes in between makes all of their work void.
REST_S = 0.1
SCENE_REST_S = 0.3
# A look that was to be quick but takes so many times its time is broken off for a newer scene.
_OVERDUE = 3.0
# Of the world's directions, what a pixel of a rough picture takes: grainy, but each marches through
# the volumes, and all of them would be most of its cost.
_ROUGH_WORLD_DRAWS = 8
# Stages whose products outlive a picture, and those of the picture itself.
_SCENE_STAGES = [native.STAGES.index(name) for name in ("upload", "medium", "shadow", "transport")]
_MEDIUM = native.STAGES.index("medium")
_TRANSPORT = native.STAGES.index("transport")
_VIEW_STAGES = [native.STAGES.index(name) for name in ("gbuffer", "shade", "march", "passes")]

_views = weakref.WeakSet()


def of(engine):
    """The view of an engine object; Blender keeps one of these per region, and the view ends
    with it."""
    view = getattr(engine, "view", None)
    if view is None:
        view = engine.view = View(engine)
        _views.add(view)
    return view


def views():
    return list(_views)


def close():
    for view in views():
        view.close()
    if bpy.app.timers.is_registered(_poll):
        bpy.app.timers.unregister(_poll)


def _poll():
    """Asks all views' jobs; ends when none is under way."""
    waiting = [view.poll() for view in views()]
    return POLL_S if any(waiting) else None


def _wake():
    if not bpy.app.timers.is_registered(_poll):
        bpy.app.timers.register(_poll, first_interval=POLL_S, persistent=True)


# ------------------------------------------------------------------------------------------------
# Scenes


_HIDING = [f"show_object_viewport_{kind}" for kind in (
    "mesh", "curve", "surf", "meta", "font", "curves", "pointcloud", "volume", "light", "empty")]


def _stage_name(depsgraph, space):
    """The same for all views that show the same objects."""
    shared = f"viewport {compat.identity(depsgraph.scene)} {depsgraph.view_layer.name}"
    shown = [getattr(space, name, True) for name in _HIDING]
    if space.local_view is None and not space.use_local_collections and all(shown):
        return shared, None
    return f"{shared} {space.as_pointer()} {shown}", space


class ViewportStage(session.Stage):
    """A scene that views share, exported as it changes."""

    def __init__(self, device, depsgraph):
        super().__init__(device, background_loads=True)
        self.changes = changes.Changes(depsgraph.scene, depsgraph.view_layer)
        self.serial = 0     # counts the exports that changed anything
        self.quality = SceneQuality()
        self.reports = []   # sentences of the last export

    @property
    def outdated(self):
        return self.changes.pending or self.target.arrived

    def export(self, depsgraph, space, target_s):
        """space: the view whose hidden objects are left out, None: none are."""
        with trace.span("export"), self.lock:
            changed = self.changes.take()
            try:
                scene.export(depsgraph, self.target, changed, space)
                reports = list(self.target.reports)
            except Exception:
                self.changes.everything()  # what was taken is not forgotten
                raise
            finally:
                if self.target.sent_kinds:
                    self.serial += 1
                    self.quality.change(self.target.sent_kinds, target_s)
        # Blender drops what a viewport's engine reports.
        for _, sentence in reports:
            if sentence not in self.reports:
                print(f"Brume: warning: {sentence}", flush=True)
        self.reports = [sentence for _, sentence in reports]


# ------------------------------------------------------------------------------------------------
# Views


class Wish(NamedTuple):
    """What a view must show: another one makes what is under way void."""
    scene: int             # serial of the export
    stage: str
    framing: framing.Framing
    finest: float          # screen pixels along the side of one of the picture's
    samples: int
    settings: tuple


class Task(NamedTuple):
    """One picture on the way to what is wished."""
    size: float            # screen pixels along the side of one of the picture's
    samples: int
    look: bool             # the first, as rough as it must be
    rough: bool            # whether it must be done again as it should be


class Picture(NamedTuple):
    serial: int
    scene: int             # serial of the export that it shows
    framing: framing.Framing
    size: float
    samples: int
    pixels: np.ndarray     # (height, width, 4), scene-linear, premultiplied, from the bottom


class View:
    def __init__(self, engine):
        self.name = f"viewport {engine.as_pointer()}"
        self.engine = weakref.ref(engine)
        self.start = None         # of the device
        self.pace = Pace()
        self.stage = None         # and the name that it is held by
        self.stage_name = None
        self.wish = None
        self.changed_at = 0.0     # when the wish became another
        self.task = None          # the last one begun for the wish; None: nothing was
        self.job = None           # of the task
        self.begun_at = 0.0
        self.received = 0         # samples of the job's picture that was taken
        self.due = None           # when to go on after a rest
        self.notified = False     # whether a redraw was asked for and has not come yet
        self.impatient = False    # whether the last look was broken off
        self.failed = None        # how the view stood when something went wrong
        self.picture = None
        self.texture = None       # of the picture, on Blender's side
        self.stats = None         # of the last job that ended

    def __del__(self):
        self.close()

    @property
    def settled(self):
        """Whether all that is wished is shown."""
        return (self.picture is not None and not self.notified and not self._waiting()
                and not self.stage.outdated)

    # -- called by Blender

    def update(self, engine, context, depsgraph):
        """Something changed; what, is collected in stage.changes. The next picture is begun before
        Blender redraws, which takes a while too."""
        with trace.span("update"):
            self.failed = None
            # Through a camera the view has not followed it yet.
            if context.region_data.view_perspective != 'CAMERA':
                self._guard(self._advance, engine, context, depsgraph)
            engine.tag_redraw()
            if self._waiting():
                _wake()

    def draw(self, engine, context, depsgraph):
        with trace.span("draw") as values:
            self.notified = False
            if self.failed != framing.state(context):
                self.failed = None
                self._guard(self._advance, engine, context, depsgraph)
            if self.picture is not None:
                self._guard(self._show, engine, context)
                values.update(view=self.name, picture=self.picture.serial,
                              scene=self.picture.scene, pixel_size=self.picture.size,
                              samples=self.picture.samples)
            if self._waiting():
                _wake()

    def poll(self):
        """On the timer: asks for a redraw where it is time for one. True while there is anything
        to wait for."""
        if self.notified or not self._waiting():
            return False
        if not self._news():
            return True
        self.notified = self.redraw()
        return False

    def redraw(self):
        """Asks Blender for a redraw; False if it has let go of the engine."""
        try:
            self.engine().tag_redraw()
        except (AttributeError, ReferenceError):
            return False
        return True

    def close(self):
        self._drop_job()
        self.due = None
        if self.stage_name is not None:
            session.leave(self.stage_name)
            self.stage_name = self.stage = None

    # -- what is under way

    def _waiting(self):
        return (self.start is not None or self.job is not None or self.due is not None
                or self.stage is not None
                and (self.stage.target.loading or self.stage.target.arrived))

    def _news(self):
        """Whether a redraw would show or begin anything."""
        if self.start is not None:
            return not self.start.is_alive()
        if self.stage.target.arrived or self.due is not None and time.perf_counter() >= self.due:
            return True
        if self.job is None:
            return False
        status = self.job.poll()
        return status.ended or status.picture_samples > self.received

    def _guard(self, work, engine, context, *arguments):
        """Does the work; what goes wrong is said in the corner, and the next change of the scene
        or of the view tries again."""
        try:
            work(engine, context, *arguments)
            return
        except native.BrumeError as error:
            sentence = f"{error.sentence} ({error.id})"
        except Exception as error:
            traceback.print_exc()
            sentence = f"{type(error).__name__}: {error}"
        self._drop_job()
        self.failed = framing.state(context)
        self.start = self.due = self.wish = self.task = None
        engine.update_stats("Brume", sentence)

    def _drop_job(self):
        if self.job is not None:
            trace.note("job", self.begun_at, **self.task._asdict(), state=native.JOB_CANCELLED)
            self.job.close()
            self.job = None

    def _hold_stage(self, depsgraph, space):
        """The stage of what the view shows now. Returns the space whose objects it hides."""
        name, own = _stage_name(depsgraph, space)
        if name != self.stage_name:
            stage = session.stage(name, lambda device: ViewportStage(device, depsgraph))
            session.join(name)
            self.close()
            self.stage_name, self.stage = name, stage
        return own

    def _advance(self, engine, context, depsgraph):
        """Takes what is finished and begins what is next."""
        if self.start is None and not session.ready():
            self.start = session.Start()
        if self.start is not None:
            if not self.start.done():
                return
            self.start = None
        now = time.perf_counter()
        settings = depsgraph.scene_eval.brume
        target_s = settings.viewport_frame_time / 1000
        own_space = self._hold_stage(depsgraph, context.space_data)
        self._receive(target_s)
        if self.job is not None and self.task.look:
            # A look is shown even if it is late: else none would be while the view turns. But one
            # that is long overdue gives way to a newer scene, though not twice in a row.
            if (not self.stage.outdated or self.impatient
                    or now - self.begun_at < _OVERDUE * target_s):
                return
            self._drop_job()
            self.impatient = True
        if self.stage.outdated:
            before = self.stage.serial
            self.stage.export(depsgraph, own_space, target_s)
            if self.stage.serial != before:
                self._tell_others()
        wish = self._wish(engine, context, depsgraph)
        if wish != self.wish:
            self._drop_job()
            self.wish, self.changed_at, self.task, self.due = wish, now, None, None
        if self.job is None and wish.framing is None:
            self.picture = None  # a border outside of the region
        elif self.job is None:
            self._begin_next(depsgraph, now, target_s)
        engine.update_stats("", self.corner(settings))

    def _tell_others(self):
        """Blender redraws all views after a change, but not after what only a look finds."""
        for view in views():
            if view is not self and view.stage is self.stage:
                view.redraw()

    def _wish(self, engine, context, depsgraph):
        scene_eval = depsgraph.scene_eval
        settings = scene_eval.brume
        return Wish(self.stage.serial, self.stage_name, framing.of(context, scene_eval),
                    engine.get_preview_pixel_size(depsgraph.scene), settings.viewport_samples,
                    (bytes(native_settings(settings)), settings.seed,
                     settings.half_resolution_volumes,
                     scene_eval.render.filter_size, scene_eval.render.film_transparent))

    def _next_task(self, target_s):
        wish, quality, last = self.wish, self.stage.quality, self.task
        width, height = wish.framing.part[2:]
        if last is None:
            size = self.pace.choose(width * height, wish.finest, target_s)
            return Task(size, 1, True, size > wish.finest or not quality.full)
        if last.size / 2 > wish.finest:
            return Task(last.size / 2, 1, False, True)
        if last.rough or last.samples < wish.samples:
            return Task(wish.finest, wish.samples, False, False)
        return None

    def _begin_next(self, depsgraph, now, target_s):
        task, self.due = self._next_task(target_s), None
        if task is None:
            return
        if not task.look:
            due = self.changed_at + (REST_S if self.stage.quality.full else SCENE_REST_S)
            if now < due:
                self.due = due
                return
        wish, scene_eval = self.wish, depsgraph.scene_eval
        settings = native_settings(scene_eval.brume)
        settings.warm = 1  # what moves from picture to picture moves little
        if task.rough and task.size > wish.finest:
            settings.step *= STEP_FACTOR
        if task.look:
            self.stage.quality.apply(settings)
        view = native.View(
            width=max(round(wish.framing.part[2] / task.size), 1),
            height=max(round(wish.framing.part[3] / task.size), 1),
            view_from_world=native.matrix(np.reshape(wish.framing.view_from_world, (4, 4))),
            clip_from_view=native.matrix(np.reshape(wish.framing.clip_from_view, (4, 4))),
            clip_near=wish.framing.clip_near, clip_far=wish.framing.clip_far,
            samples=task.samples, seed=scene_eval.brume.seed, passes=1,
            filter_width=scene_eval.render.filter_size,
            film_transparent=scene_eval.render.film_transparent,
            half_march=scene_eval.brume.half_resolution_volumes,
            progressive=task.samples > 1, urgent=task.look,
            lens=native.Lens(*wish.framing.lens),
            world_draws=_ROUGH_WORLD_DRAWS if task.rough else 0)
        with self.stage.lock:
            self.job = self.stage.scene.render(settings, view)
        self.task, self.begun_at, self.received = task, now, 0

    def _receive(self, target_s):
        """Takes the job's newest picture, and lets a job go that ended."""
        if self.job is None:
            return
        job, status = self.job, self.job.poll()
        if status.picture_samples > self.received:
            self.received = status.picture_samples
            self.picture = Picture(self.picture.serial + 1 if self.picture else 1, self.wish.scene,
                                   self.wish.framing, self.task.size, self.received, job.read(0))
            self.texture = None
            self.impatient = False
            if not self.task.look:
                self.stage.quality.rest()
        if status.ended:
            trace.note("job", self.begun_at, **self.task._asdict(), state=status.state)
            self.job = None
            try:
                job.check(status)
                if status.state == native.JOB_DONE:
                    self._learn(job.stats(), job.width * job.height, target_s)
            finally:
                job.close()

    def _learn(self, stats, pixels, target_s):
        self.stats = stats
        took_s = time.perf_counter() - self.begun_at
        scene_s, view_s = (sum(stats.stages[stage].wall_ms for stage in stages) / 1000
                           for stages in (_SCENE_STAGES, _VIEW_STAGES))
        if self.task.look:
            self.stage.quality.learn(scene_s)
        elif stats.stages[_TRANSPORT].wall_ms > 0:
            self.stage.quality.learn_full(scene_s, stats.stages[_MEDIUM].wall_ms > 0)
        if self.task.samples == 1:
            # From one picture to the next there is more: the queue, the timer, Blender's drawing.
            # If that alone takes too long, smaller pictures would not help.
            self.pace.learn(pixels, min(took_s - scene_s, view_s + 0.5 * target_s))

    def corner(self, settings):
        """What stands in the view's corner: warnings, and what the picture took if wanted."""
        said = self.stage.reports[:1]
        if self.stage.reports[1:]:
            said = [f"{len(self.stage.reports)} warnings, the first: {said[0]}"]
        if self.stage.target.loading:
            said.append("loading volumes")
        if settings.show_statistics and self.picture is not None:
            said.append(f"Sample {self.picture.samples}/{settings.viewport_samples}")
            if self.picture.size > 1:
                said.append(f"pixels of {self.picture.size:g}")
            if self.stats is not None:
                said.append(session.told(self.stats))
        return " | ".join(said)

    def _show(self, engine, context):
        """Draws the picture where it belongs, stretched if the region's size changed since."""
        import gpu  # not usable, and not needed, in background
        from gpu_extras.presets import draw_texture_2d
        if self.texture is None:
            height, width = self.picture.pixels.shape[:2]
            data = gpu.types.Buffer('FLOAT', self.picture.pixels.size,
                                    self.picture.pixels.reshape(-1))
            self.texture = gpu.types.GPUTexture((width, height), format='RGBA16F', data=data)
        (full_width, full_height), (x, y, width, height) = self.picture.framing[:2]
        stretch_x = context.region.width / full_width
        stretch_y = context.region.height / full_height
        gpu.state.blend_set('ALPHA_PREMULT')
        try:
            draw_texture_2d(self.texture, (x * stretch_x, y * stretch_y), width * stretch_x,
                            height * stretch_y)
        finally:
            gpu.state.blend_set('NONE')
