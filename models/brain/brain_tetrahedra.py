"""Tetrahedra inside the phantom's surface: Gmsh fills, then single nodes move where a dihedral angle is small."""

import numpy as np

from brain_shape import project
from brain_surface import EDGE

INTERIOR_EDGE = 6.55    # mm, wanted length of an edge inside


def fill(points, triangles):
    """Tetrahedra inside a closed surface, by Gmsh. Returns nodes (the surface's first, unmoved) and tetrahedra."""
    import gmsh
    gmsh.initialize([])
    for name, value in (("General.Terminal", 0), ("General.NumThreads", 1), ("Mesh.Algorithm3D", 1),
                        ("Mesh.Optimize", 1), ("Mesh.OptimizeThreshold", 0.45),
                        ("Mesh.MeshSizeExtendFromBoundary", 0), ("Mesh.MeshSizeMin", INTERIOR_EDGE),
                        ("Mesh.MeshSizeMax", INTERIOR_EDGE)):
        gmsh.option.setNumber(name, value)
    gmsh.model.addDiscreteEntity(2, 1)
    gmsh.model.mesh.addNodes(2, 1, list(range(1, len(points) + 1)), points.ravel().tolist())
    gmsh.model.mesh.addElementsByType(1, 2, [], (triangles + 1).ravel().tolist())
    gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop([1])], 1)
    gmsh.model.geo.synchronize()
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.optimize("Relocate3D")
    gmsh.model.mesh.optimize("")
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    corners = gmsh.model.mesh.getElementsByType(4)[1]
    gmsh.finalize()
    tags = np.asarray(tags, int)
    order = np.argsort(tags)
    number = np.full(tags.max() + 1, -1)
    number[tags[order]] = np.arange(len(tags))
    return np.asarray(xyz).reshape(-1, 3)[order], number[np.asarray(corners, int).reshape(-1, 4)]


def volumes(x, tets):
    p = x[tets]
    return np.einsum("ij,ij->i", p[:, 1] - p[:, 0], np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 0])) / 6


def min_dihedral(x, tets):
    """Smallest dihedral angle of each tetrahedron, degrees; negative for an inverted one."""
    p = x[tets]
    n = [np.cross(p[:, b] - p[:, a], p[:, c] - p[:, a]) for a, b, c in ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))]
    n = [m / np.maximum(np.linalg.norm(m, axis=1), 1e-300)[:, None] for m in n]
    worst = np.full(len(tets), 180.0)
    for i in range(4):
        for j in range(i):
            worst = np.minimum(worst, 180 - np.degrees(np.arccos(np.clip((n[i] * n[j]).sum(axis=1), -1, 1))))
    return np.where(volumes(x, tets) > 0, worst, -worst)


def improve(x, tets, num_surface, wanted=18.0, rounds=12):
    """Hill climbing: a node of a poor tetrahedron moves to the trial with the largest smallest angle around the node.

    Trials of a surface node are projected back onto the zero level.
    """
    x = x.copy()
    random = np.random.RandomState(1)
    around = [[] for _ in x]
    for i, t in enumerate(tets.tolist()):
        for v in t:
            around[v].append(i)
    size = EDGE * 0.25
    for _ in range(rounds):
        quality = min_dihedral(x, tets)
        for v in sorted(set(tets[quality < wanted].ravel().tolist())):
            star = tets[around[v]]
            trials = x[v] + random.normal(size=(24, 3)) * size * random.uniform(0.05, 1, (24, 1))
            if v < num_surface:
                trials = project(trials, 4)
                trials = trials[np.linalg.norm(trials - x[v], axis=1) < 0.4 * EDGE]
            trials = np.vstack([x[v], trials])
            where = trials[np.arange(len(trials)).repeat(len(star))]
            corners = x[np.tile(star, (len(trials), 1))]
            corners[np.tile(star == v, (len(trials), 1))] = where
            flat = corners.reshape(-1, 3)
            q = min_dihedral(flat, np.arange(len(flat)).reshape(-1, 4)).reshape(len(trials), -1).min(axis=1)
            x[v] = trials[q.argmax()]
        size *= 0.85
    return x


def outer_triangles(tets):
    """Faces that belong to one tetrahedron, turned outwards."""
    faces = np.vstack([tets[:, f] for f in ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))])
    _, first, counts = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[counts == 1])]


def mean_edge(x, triangles):
    edges = np.unique(np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), 1), axis=0)
    return float(np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1).mean())
