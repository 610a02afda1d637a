# SPDX-License-Identifier: GPL-3.0-or-later
"""How rough a picture must be to be there in time: measured on the pictures before it.

Two things are lowered while something moves. The picture's own cost grows with its pixels, so it
gets larger ones. What outlives the picture (lattices, shadow maps) is made coarser only when it
must be made anew and would take too long: its level, where each more halves the resolutions.
"""

# Screen pixels along the side of one of the picture's.
PIXEL_SIZES = (1, 1.5, 2, 3, 4, 6, 8, 12, 16)
# Steps through volumes are so much longer in a picture with larger pixels: jittered, they cost
# grain, which goes as soon as nothing moves.
STEP_FACTOR = 2.0
LEVELS = 3
# Of a scene that was never rendered: its first picture comes early on any machine.
FIRST_LEVEL = 2
# What a level takes off the time of the scene's stages, before it is measured: lattices are
# three-dimensional, but shadow maps are not.
_LEVEL_GAIN = 5.0
# What no level goes below.
_COARSEST_LATTICE, _COARSEST_SHADOW, _FEWEST_DIRECTIONS = 8, 64, 16
# The share of scattered light that iterations may leave unfound.
_ROUGHLY_CONVERGED = 0.03
# The picture is coarser or finer than the one before only where the time calls for it clearly: a
# view whose pixels keep changing their size is harder to look at than one that is a little late.
_TOO_SLOW, _FAST_ENOUGH = 1.25, 0.8
# Coarser lattices that still take this share of the time are not worth having.
_NO_GAIN = 0.8
# What is measured counts as no more than so many times what was foretold: another program may just
# have had the processor.
_OUTLIER = 3.0
# What the picture before the last counts beside the last.
_MEMORY = 0.8


def sizes(finest):
    """The pixel sizes in use, from the finest; finest: what Blender's preferences ask for."""
    return [finest] + [size for size in PIXEL_SIZES if size > finest]


class Pace:
    """Of one view: the size of its first pictures' pixels."""

    def __init__(self):
        self.size = None        # of the last picture chosen
        self._sums = (0.0,) * 5  # of 1, n, n^2, t, n t over pictures of n pixels that took t

    def choose(self, pixels, finest, target_s):
        """The pixel size of the next picture, pixels: of the screen."""
        steps = sizes(finest)
        if self.size is None:
            self.size = min(steps, key=lambda size: abs(size - 8))
            return self.size
        size = min(steps, key=lambda step: abs(step - self.size))
        number = steps.index(size)
        while (number + 1 < len(steps)
               and self._foretold(pixels / steps[number] ** 2) > _TOO_SLOW * target_s):
            number += 1
        if steps[number] == size:
            while (number > 0
                   and self._foretold(pixels / steps[number - 1] ** 2) < _FAST_ENOUGH * target_s):
                number -= 1
        self.size = steps[number]
        return self.size

    def learn(self, pixels, seconds):
        """pixels: of the picture, not of the screen."""
        if self._sums[0] > 0.0:
            seconds = min(seconds, _OUTLIER * self._foretold(pixels))
        fresh = (1.0, pixels, pixels * pixels, seconds, pixels * seconds)
        self._sums = tuple(_MEMORY * old + new for old, new in zip(self._sums, fresh))

    def _foretold(self, pixels):
        """The line t = a + b n of least squares, with neither below 0; through 0 as long as all
        pictures had one size."""
        ones, n, nn, t, nt = self._sums
        spread = ones * nn - n * n
        if ones == 0.0:
            return 0.0
        if spread > 1e-6 * n * n:
            slope = max((ones * nt - n * t) / spread, 0.0)
            fixed = (t - slope * n) / ones
            if fixed >= 0.0:
                return fixed + slope * pixels
        return nt / nn * pixels


class SceneQuality:
    """Of one native scene, shared by its views: the levels of what outlives a picture."""

    def __init__(self):
        self.level = FIRST_LEVEL        # of lattices and shadow maps
        self.medium_level = FIRST_LEVEL  # of the medium's lattice, which fewer changes touch
        self._costs = {}     # by kinds of datablocks that changed: seconds at each level
        self._levels = {}    # by kinds: the level of the last such change
        self._kinds = None   # of the change that was not yet paid for
        self._steady = True  # whether the levels are those of the picture before
        self._begun = False  # whether anything was rendered yet

    @property
    def full(self):
        return self.level == 0 and self.medium_level == 0

    def change(self, kinds, target_s):
        """Chooses the levels after an export that sent these kinds of datablocks."""
        if not self._begun:
            return
        before = self.level, self.medium_level
        self._kinds = frozenset(kinds)
        self.level = self._levels[self._kinds] = self._choose(target_s)
        if "volume" in self._kinds:
            self.medium_level = self.level
        # Where levels change, more is made anew than what the change calls for.
        self._steady = before == (self.level, self.medium_level)

    def _choose(self, target_s):
        """Unknown changes are tried at full resolution: often most of it can stay as it is."""
        costs = self._costs.get(self._kinds, {})
        level = self._levels.get(self._kinds, 0)
        if level not in costs:
            return level
        if costs[level] > _TOO_SLOW * target_s:
            if level - 1 in costs and costs[level] > _NO_GAIN * costs[level - 1]:
                return level - 1
            coarser = level + 1
            while (coarser < LEVELS and coarser not in costs
                   and costs[level] / _LEVEL_GAIN ** (coarser - level) > _TOO_SLOW * target_s):
                coarser += 1
            helps = coarser <= LEVELS and costs.get(coarser, 0.0) < _NO_GAIN * costs[level]
            return coarser if helps else level
        finer = level - 1
        if finer >= 0 and (costs.get(finer, costs[level] * _LEVEL_GAIN)
                           < _FAST_ENOUGH * target_s):
            return finer
        return level

    def rest(self):
        """Goes back to the full resolutions."""
        self.level = self.medium_level = 0
        self._begun = True

    def learn(self, seconds):
        """What the scene's stages of the picture after a change took; nothing, if another view's
        picture has paid for the change or is about to."""
        if seconds == 0.0:
            return
        if self._kinds and self._steady:
            costs = self._costs.setdefault(self._kinds, {})
            costs[self.level] = min(seconds, _OUTLIER * costs.get(self.level, seconds))
        self._kinds = None

    def learn_full(self, seconds, with_medium):
        """What all of it took at full resolution, or all but the medium: no change of that costs
        more."""
        for kinds, costs in self._costs.items():
            if with_medium or "volume" not in kinds:
                costs[0] = min(costs.get(0, seconds), seconds)

    def apply(self, settings):
        """Lowers native.Settings in place."""
        level = self.level
        if level:
            settings.lattice_resolution = _halved(settings.lattice_resolution, level,
                                                  _COARSEST_LATTICE)
            settings.field_resolution = _halved(settings.field_resolution, level,
                                                _COARSEST_LATTICE)
            settings.shadow_resolution = _halved(settings.shadow_resolution, level,
                                                 _COARSEST_SHADOW)
            settings.light_samples = _halved(settings.light_samples, level, 1)
            settings.world_samples = _halved(settings.world_samples, level, _FEWEST_DIRECTIONS)
            settings.cascades = max(settings.cascades - level, 1)
            settings.ordinates = min(settings.ordinates, 48)  # with 26 rooms are brighter
            settings.converged = _ROUGHLY_CONVERGED
            if settings.iterations:
                settings.iterations = _halved(settings.iterations, level, 1)
        if self.medium_level:
            settings.medium_resolution = _halved(settings.medium_resolution, self.medium_level,
                                                 _COARSEST_LATTICE)
        return settings


def _halved(value, times, least):
    return min(value, max(value >> times, least))
