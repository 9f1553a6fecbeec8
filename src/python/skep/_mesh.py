"""Surfaces from the results of a run, through Open3D: `python -m skep mesh RUN`."""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._camera import Camera
from ._errors import ArgumentError, FileError
from ._files import read_depth_map
from ._scene import Scene

_ENDINGS = (".ply", ".obj", ".stl", ".off", ".gltf", ".glb")
# Memory grows with the square of 2^depth; beyond 14 it is hundreds of gigabytes.
_DEPTHS = range(4, 15)
# Voxels of this many pixels, in the median over all pixels: finer ones have holes where one view sees them.
_PIXELS_PER_VOXEL = 2.0
# Distances to the surface are kept within so many voxels; the usual ratio.
_TRUNCATION = 4.0
# Views that must have averaged a voxel.
_LEAST_VIEWS = 3.0
# Pixels of a map that the size of voxels is estimated from.
_SAMPLE = 7


class MappedView(NamedTuple):
    """A view with a validated depth map."""

    name: str
    camera: Camera
    depth: NDArray[np.float32]
    photograph: Path


def open3d() -> Any:
    """The package, or an ImportError that says how to get it."""
    try:
        return importlib.import_module("open3d")
    except ImportError as error:
        text = f"meshes need open3d, which cannot be imported: {error}; pip install open3d brings it"
        raise ImportError(text) from error


def poisson(cloud: Path, depth: int = 9, trim: float = 0.05) -> Any:
    """The screened Poisson surface of a cloud with normals, an `open3d.geometry.TriangleMesh`.

    `depth` is that of the octree: each step halves its cells. Vertices that few points support are left out:
    the share `trim` of all that has the smallest density. Vertices have the colors of the points around them.
    """
    if depth not in _DEPTHS:
        raise ArgumentError(f"depth is {depth}: must be {_DEPTHS.start} to {_DEPTHS.stop - 1}")
    if not 0 <= trim < 1:
        raise ArgumentError(f"trim is {trim}: must be a share of the vertices, 0 to below 1")
    library = open3d()
    if not cloud.is_file():
        raise FileError(f"{cloud}: no such file; expected the cloud of a run")
    points = library.io.read_point_cloud(str(cloud))
    if not points.has_points() or not points.has_normals():
        raise FileError(f"{cloud}: expected points with normals, as in the fused.ply of a run")
    mesh, densities = library.geometry.TriangleMesh.create_from_point_cloud_poisson(points, depth=depth)
    if trim > 0:
        values = np.asarray(densities)
        mesh.remove_vertices_by_mask(values < np.quantile(values, trim))
    return mesh


def tsdf(run: Path, voxel: float | None = None) -> Any:
    """The surface of the validated depth maps of a run, an `open3d.geometry.TriangleMesh`: signed distances
    are averaged in voxels, and cut off four voxels from the surface. It is where three views or more have
    depths, as many as confirm a depth by default.

    `voxel` is the side of a voxel in units of the scene; None takes twice the median size of a pixel on the
    surface. Vertices have the colors of the photographs.
    """
    if voxel is not None and not (np.isfinite(voxel) and voxel > 0):
        raise ArgumentError(f"voxel is {voxel}: must be a length above 0")
    library = open3d()
    core, geometry = library.core, library.t.geometry
    side = voxel if voxel is not None else voxel_size(run)
    grid = geometry.VoxelBlockGrid(
        ("tsdf", "weight", "color"),
        (core.float32, core.float32, core.float32),
        ((1,), (1,), (3,)),
        side,
        block_resolution=16,
        block_count=10_000,
    )
    # The grid computes in 32 bits, which geographic coordinates do not fit: the first camera is its origin.
    origin: NDArray[np.float64] | None = None
    for view in mapped_views(run):
        origin = view.camera.center if origin is None else origin
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = view.camera.R, view.camera.t + view.camera.R @ origin
        # Both have the center of the top-left pixel at (0, 0).
        cameras = core.Tensor(view.camera.K), core.Tensor(pose)
        depth = geometry.Image(core.Tensor(np.ascontiguousarray(view.depth)))
        # With depths of floats it takes colors of floats only, 0 to 1.
        color = geometry.Image(core.Tensor(_photograph(library, view).astype(np.float32) / 255))
        scale_and_reach = 1.0, float(view.depth.max()) * 2, _TRUNCATION
        blocks = grid.compute_unique_block_coordinates(depth, *cameras, *scale_and_reach)
        grid.integrate(blocks, depth, color, *cameras, *scale_and_reach)
    mesh = grid.extract_triangle_mesh(weight_threshold=_LEAST_VIEWS).to_legacy()
    return mesh.translate(origin)


def _photograph(library: Any, view: MappedView) -> NDArray[np.uint8]:
    """The photograph of a view in three channels of 8 bits."""
    if not view.photograph.is_file():
        raise FileError(f"{view.photograph}: no such file; expected the photograph of {view.name}")
    pixels = np.asarray(library.io.read_image(str(view.photograph)))
    if pixels.shape[:2] != view.depth.shape:
        expected = "x".join(map(str, view.depth.shape[::-1]))
        found = "x".join(map(str, pixels.shape[1::-1])) or "no image that Open3D reads (PNG or JPEG)"
        raise FileError(f"{view.photograph}: is {found}; expected {expected}, the size of the depth map")
    if pixels.dtype == np.uint16:
        pixels = (pixels >> 8).astype(np.uint8)
    if pixels.ndim == 2 or pixels.shape[2] < 3:
        pixels = np.repeat(np.atleast_3d(pixels)[..., :1], 3, axis=2)
    return np.ascontiguousarray(pixels[..., :3])


def mapped_views(run: Path) -> Iterator[MappedView]:
    """The views of a run that have validated depths, one after the other."""
    maps = run / "stereo" / "depth_maps"
    if not maps.is_dir():
        raise FileError(f"{maps}: no such folder; expected the depth maps of a run of skep or COLMAP")
    folder = run if (run / "sparse").is_dir() else run.absolute().parent
    # Depths are not searched: any range will do where the model has no points.
    scene = Scene.read(folder, depth_range=(1.0, 2.0))
    found = False
    for number in range(len(scene)):
        name = scene.name(number)
        file = maps / f"{name}.geometric.bin"
        if not file.is_file():
            continue
        depth = read_depth_map(file)
        if not depth.any():
            continue
        width, height = scene.size(number)
        if depth.shape != (height, width):
            shape = "x".join(map(str, depth.shape[::-1]))
            raise FileError(f"{file}: the map is {shape}; expected {width}x{height}, the size of its camera")
        found = True
        yield MappedView(name, scene.camera(number), depth, folder / "images" / name)
    if not found:
        raise FileError(f"{maps}: no validated depth in any map of the scene's views (NAME.geometric.bin)")


def voxel_size(run: Path) -> float:
    """Twice the median size of a pixel on the surface."""
    sizes = []
    for view in mapped_views(run):
        sample = view.depth[::_SAMPLE, ::_SAMPLE]
        sizes.append(sample[sample > 0] / view.camera.K[0, 0])
    found = np.concatenate(sizes)
    if found.size == 0:
        raise FileError(f"{run}: too few validated depths to choose the size of voxels; pass it (--voxel)")
    return float(_PIXELS_PER_VOXEL * np.median(found))


def drop_small(mesh: Any, triangles: int) -> None:
    """Removes the connected parts of a mesh with fewer triangles."""
    if triangles <= 1 or not mesh.has_triangles():
        return
    clusters, counts, _ = mesh.cluster_connected_triangles()
    mesh.remove_triangles_by_mask(np.asarray(counts)[np.asarray(clusters)] < triangles)
    mesh.remove_unreferenced_vertices()


def parser() -> argparse.ArgumentParser:
    made = argparse.ArgumentParser(
        "skep mesh", description="Make a mesh of the results of a run, with Open3D: pip install open3d."
    )
    add = made.add_argument
    add("run", type=Path, metavar="RUN", help="folder of the results of `skep reconstruct`")
    add("-o", "--output", type=Path, metavar="FILE", help="file of the mesh (default: RUN/mesh.ply)")
    add(
        "--method",
        choices=["poisson", "tsdf"],
        default="poisson",
        help="poisson: a closed surface through RUN/fused.ply, cut where few points are; "
        "tsdf: the mean of the validated depth maps, open where there are none",
    )
    add("--cloud", type=Path, metavar="FILE", help="poisson: another cloud (default: RUN/fused.ply)")
    add("--depth", type=int, default=9, metavar="N", help="poisson: depth of the octree (default: 9)")
    add(
        "--trim",
        type=float,
        default=0.05,
        metavar="Q",
        help="poisson: share of the vertices to leave out, those of the smallest density (default: 0.05)",
    )
    add("--voxel", type=float, metavar="SIZE", help="tsdf: side of a voxel (default: twice that of a pixel)")
    add(
        "--min-triangles",
        type=int,
        default=100,
        metavar="N",
        help="leave out connected parts of fewer triangles (default: 100)",
    )
    add("-q", "--quiet", action="store_true", help="print warnings and errors only")
    return made


def main(arguments: Sequence[str]) -> int:
    """Does what the arguments say; returns the exit status."""
    given = parser().parse_args(arguments)
    output: Path = given.output or given.run / "mesh.ply"
    if output.suffix.lower() not in _ENDINGS:
        raise ArgumentError(f"--output is {output}: must end in one of {', '.join(_ENDINGS)}")
    library = open3d()
    # Its warnings about single vertices go to standard output.
    library.utility.set_verbosity_level(library.utility.VerbosityLevel.Error)
    if given.method == "poisson":
        mesh = poisson(given.cloud or given.run / "fused.ply", given.depth, given.trim)
    else:
        mesh = tsdf(given.run, given.voxel)
    drop_small(mesh, given.min_triangles)
    if not mesh.has_triangles():
        print("skep: the mesh is empty: --trim or --min-triangles leaves nothing", file=sys.stderr)
        return 1
    mesh.compute_vertex_normals()
    output.parent.mkdir(parents=True, exist_ok=True)
    if not library.io.write_triangle_mesh(str(output), mesh):
        raise FileError(f"{output}: cannot be written")
    if not given.quiet:
        print(f"{len(mesh.vertices)} vertices and {len(mesh.triangles)} triangles in {output}")
    return 0
