"""Every number the method depends on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Literal, Union

import numpy as np

from ._buffers import take_text, text
from ._errors import check
from ._native import ffi, lib

Value = Union[int, float, bool, str]
"""The value of an option."""


def _names() -> Iterator[str]:
    position = 0
    while name := lib.skep_option_name(position):
        yield ffi.string(name).decode()
        position += 1


_NAMES = tuple(_names())


def _by_any_name() -> dict[str, str]:
    """The full name of an option by each of its names."""
    fields = [name.rpartition(".")[2] for name in _NAMES]
    full = {field: name for field, name in zip(fields, _NAMES) if fields.count(field) == 1}
    full |= {name.replace(".", "_"): name for name in _NAMES}
    return full | {name: name for name in _NAMES}


_BY_ANY_NAME = _by_any_name()


class Options(Mapping[str, Value]):
    """Options by name, as items or attributes.

    `options["check.depth_tolerance"]` is `options.check_depth_tolerance`. The group may be left out where no
    other group has an option of that name: `options.window_radius`. Values are checked when they are set.

    Starts from a preset: "default" is the most accurate, "fast" takes less than half of its time, "paper"
    follows the paper literally. `Options("fast", threads=2, fusion_min_agreeing_views=2)` sets some at once.
    """

    __slots__ = ("_handle",)

    _handle: Any

    # BEGIN OPTIONS
    seed: int
    """Seed of the random generator; the same seed gives the same bits. (whole number, 0 to
    18446744073709551615, any; default: 0)"""
    threads: int
    """Worker threads at most; 0 takes one for each core. At most four for each core are started, and no more
    than the images keep busy. The result does not depend on it. (whole number, 0 to 4096, threads; default:
    0)"""
    memory: int
    """Bytes of memory that a run in a folder keeps to; 0 takes three quarters of what the machine or its
    control group allows. The result does not depend on it. (whole number, 0 to 9007199254740992, bytes;
    default: 0)"""
    simd: str
    """Instruction set: scalar, baseline, v3, or best for the best the machine has; the result does not depend
    on it. (name; default: best)"""
    input_max_image_size: int
    """Largest side of the photographs of a scene in files: larger ones are reduced, and the maps have their
    reduced size. 0 keeps all pixels. (whole number, 0 to 32768, pixels; default: 0)"""
    input_alpha_mask: bool
    """Pixels of alpha 0 are ignored like masked ones. (switch, true or false; default: false)"""
    input_images: str
    """The photographs to take: names or patterns with * and ?, separated by commas, or the path of a text
    file with one on each line; all if empty. (text; default: )"""
    input_reference: str
    """The photographs that get maps, in the form of input.images; all if empty. Of the others only their
    source views are taken, which get none. (text; default: )"""
    input_masks: str
    """Folder of masks: NAME.png for the photograph NAME; where it is 0 nothing is estimated. None if empty.
    (path; default: )"""
    input_sources: str
    """File with the source views of each view, in the layout of COLMAP's patch-match.cfg; chosen by
    triangulation angle if empty. (path; default: )"""
    input_depth_ranges: str
    """File with depth ranges of views, lines NAME NEAR FAR; the ranges of other views follow from the sparse
    points. None if empty. (path; default: )"""
    input_bounds: str
    """Box of the world in which surfaces are reconstructed, x0 y0 z0 x1 y1 z1; everything if empty. (text;
    default: )"""
    schedule_scales: str
    """Scales from coarse to fine, each twice as large as the one before, the last at full size: `downscale=2
    food_sources=3 iterations=5+4x1; downscale=1 food_sources=2 iterations=1+2x1` is half size with 3 food
    sources a pixel, 5 iterations in the first cycle and 4 more cycles of 1, then full size. (text; default:
    downscale=2 food_sources=3 iterations=5+4x1; downscale=1 food_sources=2 iterations=1+2x1, fast:
    downscale=2 food_sources=2 iterations=4+3x1; downscale=1 food_sources=2 iterations=0+0x1, paper:
    downscale=1 food_sources=10 iterations=20+3x2)"""
    schedule_min_changed_fraction: float
    """From the second cycle of a scale on, the scale ends early once fewer than this fraction of the pixels
    changed their depth. (number, 0 to 1, fraction of the pixels; default: 0.01)"""
    window_window_radius: int
    """Half the side of the window. (whole number, 1 to 16, pixels; default: 5)"""
    window_full_size_window_radius: int
    """The same at full size after coarser scales, where the window is a square; 0 keeps `window_radius`.
    (whole number, 0 to 16, pixels; default: 3, paper: 0)"""
    window_window_step: int
    """Distance between the samples of the window. (whole number, 1 to 8, pixels; default: 2)"""
    window_circular_window: bool
    """Leave out the corners of the window: a disc of samples instead of a square. (switch, true or false;
    default: true, paper: false)"""
    window_sigma_spatial: float
    """Sigma of the bilateral weight in space. (number, 0.001 to 1000000, pixels; default: 3, paper: 5)"""
    window_sigma_color: float
    """Sigma of the bilateral weight in gray value. (number, 0.001 to 1000000, gray value, of [0, 1]; default:
    0.03, paper: 0.2)"""
    window_min_variance: float
    """Weighted variance under which a window has no texture and costs 2. (number, 0 to 1, squared gray value,
    of [0, 1]; default: 0.00001)"""
    window_min_texture_to_noise: float
    """Ratio of the window's variance to the image noise under which the pixel is not matched: it keeps the
    plane of the cycle before where that matches in a larger window, or is filled from the surrounding planes.
    0 matches all pixels. (number, 0 to 1000, ratio of variances; default: 2.5, paper: 0)"""
    cost_best_views: int
    """Mean over the best views of the pixel's view set; 0 takes the sum over all divided by one less than
    their number (equation 3 of the paper). (whole number, 0 to 8, views; default: 4, fast: 3, paper: 0)"""
    cost_max_views_per_pixel: int
    """From the second cycle on, match a pixel only with this many views of its set: those whose validated
    surfaces its plane agrees with best, or of lowest cost where too few of them agree; 0 takes the whole set.
    (whole number, at least 0, views; default: 5, fast: 4, paper: 0)"""
    cost_geom_consistency_weight: float
    """Geometric consistency: cost at the largest error against the validated depth of a source view; 0 turns
    the term off. (number, 0 to 1000, cost; default: 0.3, paper: 0)"""
    cost_geom_consistency_max_error: float
    """Relative depth error against a source view's validated depth at which the penalty saturates; quadratic
    below. (number, 0.00001 to 10, fraction of the depth; default: 0.02, paper: 0.03)"""
    cost_geom_consistency_missing_error: float
    """Relative depth error that is assumed where the source view has no validated depth. (number, 0 to 10,
    fraction of the depth; default: 0.0175, paper: 0.015)"""
    cost_smoothness_weight: float
    """Smoothness: cost of a plane that contradicts the validated planes of all four neighbors of similar gray
    value; 0 turns the term off. (number, 0 to 1000, cost; default: 0.1, fast: 0.2, paper: 0)"""
    cost_smoothness_max_depth_error: float
    """Relative depth error against a neighbor's plane at which the smoothness penalty saturates; quadratic
    below. (number, 0.000001 to 1, fraction of the depth; default: 0.01)"""
    cost_smoothness_max_normal_error: float
    """Angle to a neighbor's normal at which the smoothness penalty saturates; quadratic in 1 - cos below.
    (number, 0.001 to 180, degrees; default: 40)"""
    search_trial_limit: int
    """Failed attempts to improve a food source after which a scout bee may replace it. (whole number, at
    least 0, attempts; default: 10)"""
    search_employed_bees: int
    """In the first cycle, the number of food sources, best first, that employed bees perturb; no colony has
    more than 64. (whole number, 0 to 64, food sources; default: 1, paper: 64)"""
    search_later_employed_bees: int
    """The same from the second cycle on, where the food sources that a colony starts with are perturbations
    already. (whole number, 0 to 64, food sources; default: 0, paper: 64)"""
    search_onlooker_tournament_size: int
    """Random neighbors of which an onlooker bee visits the one of lowest cost; different gray values raise
    the cost. (whole number, 1 to 20, neighbors; default: 3, fast: 6, paper: 1)"""
    search_local_plane_tolerance: float
    """In the first cycle, relative inverse-depth error up to which a neighbor takes part in the local plane
    fit of each iteration; 0 fits no planes. (number, 0 to 1, fraction of the inverse depth; default: 0.02,
    fast: 0.03, paper: 0)"""
    search_depth_perturbation: float
    """From the second cycle on, half the range of inverse depths in which food sources start around a
    validated estimate, halved each cycle of a scale; 0 starts them at random. Around an estimate that is not
    validated one starts so, unless there is a candidate of another view, and the others at random. (number, 0
    to 0.5, fraction of the inverse depth; default: 0.01, fast: 0.005, paper: 0)"""
    search_normal_perturbation: float
    """Half the side of the cube from which a vector is added to the normals of those food sources, halved
    each cycle of a scale. (number, 0 to 10, length, of a unit normal; default: 0.3, paper: 0)"""
    search_smoothness_reward: float
    """Fitness bonus of a plane that comes from a validated neighbor, in the comparison only (section 5.6 of
    the paper); 0 turns it off. (number, 0 to 1, fitness; default: 0.05)"""
    search_view_propagation: bool
    """Propagate consistent planes to the pixels of other views that have no validated plane. (switch, true or
    false; default: true)"""
    view_selection_pixelwise_view_selection: bool
    """Refine the view set of each pixel by incident angle and visibility; off keeps all source views.
    (switch, true or false; default: true)"""
    view_selection_min_triangulation_angle: float
    """Smallest triangulation angle of a source view. (number, 0 to 180, degrees; default: 3, paper: 10)"""
    view_selection_max_triangulation_angle: float
    """Largest triangulation angle of a source view. (number, 0 to 180, degrees; default: 60, paper: 30)"""
    view_selection_min_sources: int
    """Source views that a view gets at least, where as many overlap with it: if fewer lie in the range of
    angles, those nearest to it are added. (whole number, at least 0, views; default: 6, paper: 0)"""
    view_selection_max_sources: int
    """Source views of a view at most; of more, those that are the most useful beside each other. 0 takes all.
    (whole number, at least 0, views; default: 12, fast: 8, paper: 0)"""
    view_selection_max_incident_angle: float
    """Largest angle between the normal and the ray to a source view. (number, 0 to 90, degrees; default:
    80)"""
    view_selection_occlusion_tolerance: float
    """Relative depth by which a validated surface of a source view must lie in front of a point to occlude
    it. (number, 0 to 1, fraction of the depth; default: 0.01)"""
    check_depth_tolerance: float
    """Largest relative depth difference of consistent planes. (number, 0 to 1, fraction of the depth;
    default: 0.01)"""
    check_normal_tolerance: float
    """Largest angle between the normals of consistent planes. (number, 0 to 180, degrees; default: 30)"""
    check_reprojection_tolerance: float
    """Reprojection error up to which depths count as equal at any triangulation angle, also beyond
    `depth_tolerance`; widened where the poses have larger errors. 0 leaves it to `depth_tolerance` alone.
    (number, 0 to 100, pixels; default: 1.25, paper: 0)"""
    check_slant_tolerance: float
    """Reprojection error, at the distance of a window's radius, up to which normals count as equal at any
    triangulation angle; 0 leaves it to `normal_tolerance` alone. (number, 0 to 100, pixels; default: 1,
    paper: 0)"""
    check_min_consistent_views: int
    """Source views that must be consistent to validate a plane; with 1 and `best_views` a single source view
    is enough to match a pixel, as scenes of two views need. (whole number, at least 1, views; default: 2)"""
    check_min_consistent_fraction: float
    """Fraction of the pixel's view set that must be consistent to validate a plane. (number, 0 to 1, fraction
    of the view set; default: 0.5, paper: 0.7)"""
    check_few_views: int
    """Where at most this many source views see the surface, a single consistent one validates a plane, if the
    errors of the poses leave its depth certain; 0 asks for `min_consistent_views` everywhere. (whole number,
    0 to 255, views; default: 2, paper: 0)"""
    check_ignore_occluders: bool
    """Leave source views whose own depth is clearly smaller out of that fraction: they may be occluded there.
    (switch, true or false; default: true, paper: false)"""
    refine_fattening_passes: int
    """Passes of the correction of foreground fattening after a check that may be the last of its scale; 0
    turns it off. (whole number, 0 to 100, passes; default: 2, paper: 0)"""
    refine_smoothing_passes: int
    """Passes of plane smoothing after each check; 0 turns it off. (whole number, 0 to 100, passes; default:
    1, fast: 2, paper: 0)"""
    refine_cross_view_averaging: bool
    """Average validated planes with those of the source views after the last cycle. (switch, true or false;
    default: true, paper: false)"""
    refine_fill_gaps: bool
    """Fill small gaps from the surrounding planes after the last cycle, where the source views confirm them.
    (switch, true or false; default: true, paper: false)"""
    refine_max_speckle_size: int
    """Largest number of pixels of a speckle after the last cycle: an island of validated planes that no
    surface around it continues. Speckles lose their validation; 0 keeps them. (whole number, at least 0,
    pixels; default: 30, paper: 0)"""
    fusion_depth_tolerance: float
    """Largest relative depth difference of pixels that are fused. (number, 0 to 1, fraction of the depth;
    default: 0.01)"""
    fusion_normal_tolerance: float
    """Largest angle between the normals of pixels that are fused. (number, 0 to 180, degrees; default: 30)"""
    fusion_reprojection_tolerance: float
    """Reprojection error up to which depths count as equal at any triangulation angle, also beyond
    `depth_tolerance`; 0 leaves it to `depth_tolerance` alone. (number, 0 to 100, pixels; default: 1.25,
    paper: 0)"""
    fusion_min_agreeing_views: int
    """Other views that must agree with a pixel to make a point, where enough see the surface. (whole number,
    at least 0, views; default: 3, paper: 4)"""
    fusion_min_agreeing_fraction: float
    """Fraction of the views that see the surface which must agree, at least one, where that is fewer than
    `min_agreeing_views`; no view may then contradict the point. 0 asks for `min_agreeing_views` everywhere.
    (number, 0 to 1, fraction of the views; default: 0.5, paper: 0)"""
    fusion_min_confidence: float
    """Smallest confidence of pixels that are fused. (number, 0 to 1, probability; default: 0)"""
    fusion_compensate_exposure: bool
    """Multiply the colors of each photograph by a factor for each channel, so that photographs of different
    exposure or white balance agree on the points they share. (switch, true or false; default: true, paper:
    false)"""
    fusion_voxel_size: float
    """Side of the cubes in which all points become one: the mean of their positions, normals and colors, seen
    by all of their views. 0 keeps all points. (number, 0 to 1000000000000, units of the scene; default: 0)"""
    fusion_max_points: int
    """Points of the cloud at most: of more, so many are drawn at random. 0 keeps all points. (whole number,
    at least 0, points; default: 0)"""
    output_write: str
    """Files of each view: some of depth, normals, confidence, status, graphs, previews, separated by commas;
    with + or - before each name they are added to those of the default or left out. (text; default:
    depth,normals,confidence,status,previews)"""
    output_cloud_format: str
    """Format of the cloud: ply, las or laz. (name; default: ply)"""
    output_splat: bool
    """Write a scene for Gaussian splatting too, in `splat/`: photographs, cameras, and the cloud as the
    points to start from. (switch, true or false; default: false)"""
    # END OPTIONS

    def __init__(self, preset: Literal["default", "fast", "paper"] = "default", **values: Value) -> None:
        out = ffi.new("skep_options **")
        check(lib.skep_options_create(text(preset, "preset"), out))
        object.__setattr__(self, "_handle", ffi.gc(out[0], lib.skep_options_destroy))
        for name, value in values.items():
            self[name] = value

    def __getitem__(self, name: str) -> Value:
        if name not in _BY_ANY_NAME:
            raise KeyError(name)
        full = _BY_ANY_NAME[name]
        value = take_text(lambda *out: lib.skep_options_get_text(self._handle, full.encode(), *out))
        return _TYPES[full](value)

    def __setitem__(self, name: str, value: Value) -> None:
        full = text(_BY_ANY_NAME.get(name, name), "name")
        if isinstance(value, (bool, np.bool_)):
            value = str(value).lower()
        # A text represents every whole number, and the shortest text of a float is read back exactly.
        check(lib.skep_options_set_text(self._handle, full, text(str(value), name)))

    def __contains__(self, name: object) -> bool:
        return name in _BY_ANY_NAME

    def __iter__(self) -> Iterator[str]:
        return iter(_NAMES)

    def __len__(self) -> int:
        return len(_NAMES)

    def __getattr__(self, attribute: str) -> Value:
        if attribute not in _BY_ANY_NAME:
            raise AttributeError(f"no option {attribute!r}")
        return self[attribute]

    def __setattr__(self, attribute: str, value: Value) -> None:
        if attribute not in _BY_ANY_NAME:
            raise AttributeError(f"no option {attribute!r}")
        self[attribute] = value

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(name for name in _BY_ANY_NAME if name.isidentifier())]

    def __reduce__(self) -> tuple[Callable[..., Options], tuple[dict[str, Value]]]:
        return _from_values, (dict(self),)

    def __repr__(self) -> str:
        usual = Options()
        changed = {name: value for name, value in self.items() if value != usual[name]}
        texts = (f"{name.replace('.', '_')}={value!r}" for name, value in changed.items())
        return f"Options({', '.join(texts)})"


def _from_values(values: dict[str, Value]) -> Options:
    """Options of these values: what a copy or a pickle holds."""
    options = Options()
    for name, value in values.items():
        options[name] = value
    return options


def _switch(value: str) -> bool:
    return value == "true"


_FROM_TEXT: dict[str, Callable[[str], Value]] = {"int": int, "float": float, "bool": _switch, "str": str}
_TYPES = {name: _FROM_TEXT[Options.__annotations__[name.replace(".", "_")]] for name in _NAMES}


def handle(options: Options | None) -> Any:
    """The options for the library; None is the default preset."""
    return ffi.NULL if options is None else options._handle
