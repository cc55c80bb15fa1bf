#!/usr/bin/python3
"""Makes brain.inp and brain_push.inp: a brain phantom of about 3,921 nodes, 2,886 of them free, with a stiff inclusion.

    /usr/bin/python3 make_brain.py            writes both files beside this script, then checks them
    /usr/bin/python3 make_brain.py --check    checks the present files

How:
1. brain_shape.py defines the surface as the zero level of a function.
2. brain_surface.py meshes the surface with triangles.
3. brain_tetrahedra.py fills the inside.
4. This file chooses the sets and writes the files; brain_check.py checks them.
Seeded and single-threaded: two runs on one machine write the same bytes.

Needs Debian's python3-gmsh (4.8.4) and python3-numpy. Axes: x to one side, y to the front, z up, millimetres.
"""

import sys

import numpy as np

from brain_check import HERE, NUM_FREE, check
from brain_surface import make_surface
from brain_tetrahedra import fill, improve, mean_edge, outer_triangles, volumes

NUM_PROBE = 60          # touchable nodes
PROBE_CENTRE = (34.0, 10.0, 110.0)  # mm; the site nearest this point is the middle of the PROBE region
INCLUSION_DEPTH = 16.0  # mm from that node to the inclusion's centre, along the inward normal
INCLUSION_RADIUS = 6.5  # mm; a tetrahedron belongs to it if its centroid is inside
TIP_RADIUS = 10.0       # mm along the surface, as in brain.toml: the patch that brain_push.inp moves
TISSUE_LAW = (1.0, 4.0)      # mu, lambda in mN/mm^2 (kPa)
INCLUSION_LAW = (5.0, 20.0)


def along_surface(x, triangles, start):
    """Shortest way from node `start` along surface edges to every node (Dijkstra), mm."""
    import heapq
    near = {}
    for t in triangles.tolist():
        for a, b in ((0, 1), (1, 2), (2, 0)):
            near.setdefault(t[a], set()).add(t[b])
            near.setdefault(t[b], set()).add(t[a])
    distance, heap = {}, [(0.0, start)]
    while heap:
        d, v = heapq.heappop(heap)
        if v in distance:
            continue
        distance[v] = d
        for w in sorted(near[v]):
            if w not in distance:
                heapq.heappush(heap, (d + float(np.linalg.norm(x[v] - x[w])), w))
    return distance


def inward_normal(x, triangles, v):
    t = triangles[(triangles == v).any(axis=1)]
    n = np.cross(x[t[:, 1]] - x[t[:, 0]], x[t[:, 2]] - x[t[:, 0]]).sum(axis=0)
    return -n / np.linalg.norm(n)


def make_sets(x, tets):
    """Node sets (indices) and the stiff elements."""
    triangles = outer_triangles(tets)
    surface = np.unique(triangles)
    fixed = np.sort(np.lexsort((np.arange(len(x)), x[:, 2]))[:len(x) - NUM_FREE])
    centre = int(surface[np.linalg.norm(x[surface] - PROBE_CENTRE, axis=1).argmin()])
    distance = along_surface(x, triangles, centre)
    nearest = sorted(distance, key=lambda v: (distance[v], v))
    upward = [v for v in nearest[:3 * NUM_PROBE] if inward_normal(x, triangles, v)[2] < -0.35]  # not the fissure's wall
    probe = np.sort(upward[:NUM_PROBE])
    h = mean_edge(x, triangles)
    push = np.sort([v for v, d in distance.items() if d <= TIP_RADIUS])
    inward = inward_normal(x, triangles, centre)
    middle = x[centre] + INCLUSION_DEPTH * inward
    stiff = np.flatnonzero(np.linalg.norm(x[tets].mean(axis=1) - middle, axis=1) < INCLUSION_RADIUS)
    return dict(fixed=fixed, surface=surface, probe=probe, push=push, centre=centre, inward=inward, h=h, stiff=stiff,
                triangles=triangles)


def rows_of(numbers, width=12):
    numbers = [str(int(n)) for n in numbers]
    return [", ".join(numbers[i:i + width]) for i in range(0, len(numbers), width)]


def write(x, tets, sets):
    stiff = np.zeros(len(tets), bool)
    stiff[sets["stiff"]] = True
    lines = ["*HEADING", "Brain phantom, made by make_brain.py. Units: mm, mN, kPa (mN/mm^2).",
             f"** {len(x)} nodes, {len(tets)} tetrahedra, {NUM_FREE} free nodes, mean surface edge {sets['h']:.2f} mm",
             "*NODE, NSET=NALL"]
    lines += [f"{i}, {p[0]:.4f}, {p[1]:.4f}, {p[2]:.4f}" for i, p in enumerate(x, 1)]
    number = 1
    for name, which in (("TISSUE", ~stiff), ("INCLUSION", stiff)):
        lines.append(f"*ELEMENT, TYPE=C3D4, ELSET={name}")
        for t in (tets[which] + 1).tolist():
            lines.append(f"{number}, {t[0]}, {t[1]}, {t[2]}, {t[3]}")
            number += 1
    for name in ("fixed", "surface", "probe"):
        lines += [f"*NSET, NSET={name.upper()}"] + rows_of(sets[name] + 1)
    for name, law in (("TISSUE", TISSUE_LAW), ("INCLUSION", INCLUSION_LAW)):
        lines += [f"*MATERIAL, NAME={name}", "** mu, lambda in kPa",
                  "*HYPERELASTIC, COMPRESSIBLE NEO HOOKE", f"{law[0]}, {law[1]}",
                  f"*SOLID SECTION, ELSET={name}, MATERIAL={name}"]
    lines += ["*BOUNDARY", "FIXED, 1, 3"]
    (HERE / "brain.inp").write_text("\n".join(line.rstrip() for line in lines) + "\n")

    move = sets["h"] * sets["inward"]
    lines = ["** The brain phantom, one patch of its upper surface pushed in by one mean edge length.",
             "*INCLUDE, INPUT=brain.inp",
             "** The same push as an argument of `palpate eval`:",
             "** contact: " + f"{sets['centre'] + 1}=" + ",".join(f"{value:.4f}" for value in move),
             f"** Node {sets['centre'] + 1} and the surface nodes within {TIP_RADIUS} mm of it along the surface edges",
             "*NSET, NSET=PUSH"] + rows_of(sets["push"] + 1)
    lines += ["*STEP, NLGEOM=YES", "*STATIC", "*BOUNDARY"]
    lines += [f"PUSH, {axis}, {axis}, {value:.4f}" for axis, value in enumerate(move, 1)] + ["*END STEP"]
    (HERE / "brain_push.inp").write_text("\n".join(lines) + "\n")


def main():
    if "--check" not in sys.argv[1:]:
        points, triangles = make_surface()
        x, tets = fill(points, triangles)
        turned = volumes(x, tets) < 0
        tets[turned] = tets[turned][:, [0, 2, 1, 3]]
        x = np.round(improve(x, tets, len(points)), 4) + 0.0
        write(x, tets, make_sets(x, tets))
    check()


if __name__ == "__main__":
    main()
