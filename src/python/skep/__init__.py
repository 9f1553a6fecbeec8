"""Dense multi-view stereo on the CPU.

From calibrated photographs to depth, normal and source-view maps and a fused point cloud:

    scene = skep.Scene()
    for photograph, (K, R, t) in zip(photographs, cameras):
        scene.add_view(photograph, skep.Camera(K, R, t), depth_range=(2.0, 6.0))
    result = skep.reconstruct(scene, progress=lambda progress: print(f"{progress.done:.0%}"))
    depth, points = result[0].validated_depth, result.cloud.positions
    why_empty = result[0].status  # of every pixel a PixelStatus; result[0].depth is the raw estimate

There are four levels, which can be mixed: whole runs (`reconstruct`), runs in a folder that may be larger
than memory and go on after an interruption (`Job`; on a cluster of Dask `skep.distributed`), the stages of a
run on single views (`Stepper`), and kernels (`plane_homographies`, `patch_ncc`).

Conventions: x_cam = R x_world + t with x right, y down, z forward; depth is z; the center of the
top-left pixel is (0, 0). Input arrays are copied, or read only during the call. The same input, options
and version give the same bits. Calls release the interpreter's lock, and any function may be called from any
thread.
"""

from ._camera import Camera
from ._cloud import Cloud, FusionView, fuse
from ._errors import (
    ArgumentError,
    Cancelled,
    CapacityError,
    Error,
    FileError,
    InternalError,
    NotEnoughMemoryError,
    PoisonedError,
)
from ._files import (
    read_consistency_graph,
    read_depth_map,
    read_normal_map,
    write_consistency_graph,
    write_depth_map,
    write_normal_map,
)
from ._job import Job, JobNeeds, Task
from ._kernels import NccWindow, PackedImage, patch_ncc, plane_homographies, plane_through
from ._native import ffi as _ffi, lib as _lib
from ._options import Options
from ._pycolmap import from_pycolmap
from ._result import CycleRecord, PixelStatus, Result, ResultView, Statistics, reconstruct
from ._run import CANCEL, Phase, Progress
from ._scene import Scene
from ._stepper import Candidates, Cycle, Estimate, EstimateInfo, EstimateMaps, Stepper

__version__: str = _ffi.string(_lib.skep_version()).decode()


def simd_level_name() -> str:
    """The default instruction set of runs (option "simd"): "scalar", "baseline" or "v3"
    (AVX2).
    """
    name: str = _ffi.string(_lib.skep_simd_level_name()).decode()
    return name


__all__ = [
    "CANCEL",
    "ArgumentError",
    "Camera",
    "Cancelled",
    "Candidates",
    "CapacityError",
    "Cloud",
    "Cycle",
    "CycleRecord",
    "Error",
    "Estimate",
    "EstimateInfo",
    "EstimateMaps",
    "FileError",
    "FusionView",
    "InternalError",
    "NotEnoughMemoryError",
    "Job",
    "JobNeeds",
    "NccWindow",
    "Options",
    "PackedImage",
    "Phase",
    "PixelStatus",
    "PoisonedError",
    "Progress",
    "Result",
    "ResultView",
    "Scene",
    "Statistics",
    "Stepper",
    "Task",
    "from_pycolmap",
    "fuse",
    "patch_ncc",
    "plane_homographies",
    "plane_through",
    "read_consistency_graph",
    "read_depth_map",
    "read_normal_map",
    "reconstruct",
    "simd_level_name",
    "write_consistency_graph",
    "write_depth_map",
    "write_normal_map",
]
