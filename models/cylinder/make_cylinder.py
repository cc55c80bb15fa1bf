#!/usr/bin/python3
"""Makes cylinder.inp and cylinder_push.inp: the cylinder of Zhong et al. 2005, figure 2.

    /usr/bin/python3 make_cylinder.py            writes both files beside this script, then checks them
    /usr/bin/python3 make_cylinder.py --check    checks the files that are there

The paper gives the size (radius 30, height 20), the points P1, P2, P3 and P_m of its tables, and the counts (195 nodes,
586 tetrahedra), but no mesh. This mesh has the same points and counts. A search over the sizes below found the counts
with the largest smallest angle; then single nodes moved where an angle was small.

One thread, no clock, fixed seed: two runs on one machine write the same bytes.

Needs Debian's python3-gmsh (4.8.4) and python3-numpy. Axis z, base at z = 0, no units (the paper names none).
"""

import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
RADIUS, HEIGHT = 30.0, 20.0
POINTS = {"P1": (0.0, 0.0, 20.0), "P2": (0.0, 30.0, 20.0), "P3": (30.0, 0.0, 20.0), "PM": (-9.42, 5.32, 20.0)}
NUM_NODES, NUM_TETRAHEDRA = 195, 586
TOP_PARTS, BOTTOM_PARTS, SIDE_PARTS = 4, 5, 3  # divisions of a quarter of the rims, and of the height
TOP_SIZE, SIZE = 7.93, 8.02                    # wanted edge at the points of the top, and anywhere at most
LAW = (0.48, 0.2)                              # mu, lambda


def make_mesh():
    """Nodes and tetrahedra by Gmsh."""
    import gmsh
    gmsh.initialize([])
    for name, value in (("General.Terminal", 0), ("General.NumThreads", 1), ("Mesh.Algorithm", 6),
                        ("Mesh.Algorithm3D", 1), ("Mesh.Optimize", 1), ("Mesh.MeshSizeMin", TOP_SIZE / 2),
                        ("Mesh.MeshSizeMax", SIZE)):
        gmsh.option.setNumber(name, value)
    geo = gmsh.model.geo

    def ring(z, size):
        centre = geo.addPoint(0, 0, z, size)
        rim = [geo.addPoint(RADIUS * x, RADIUS * y, z, 0) for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))]
        return centre, rim

    centre_bottom, bottom = ring(0, SIZE)
    centre_top, top = ring(HEIGHT, TOP_SIZE)
    arcs_bottom = [geo.addCircleArc(bottom[i], centre_bottom, bottom[(i + 1) % 4]) for i in range(4)]
    arcs_top = [geo.addCircleArc(top[i], centre_top, top[(i + 1) % 4]) for i in range(4)]
    sides = [geo.addLine(bottom[i], top[i]) for i in range(4)]
    base = geo.addPlaneSurface([geo.addCurveLoop(arcs_bottom)])
    lid = geo.addPlaneSurface([geo.addCurveLoop(arcs_top)])
    walls = [geo.addSurfaceFilling([geo.addCurveLoop([arcs_bottom[i], sides[(i + 1) % 4], -arcs_top[i], -sides[i]])])
             for i in range(4)]
    geo.addVolume([geo.addSurfaceLoop([base, lid] + walls)])
    marked = geo.addPoint(*POINTS["PM"], TOP_SIZE)
    geo.synchronize()
    gmsh.model.mesh.embed(0, [centre_top, marked], 2, lid)
    gmsh.model.mesh.embed(0, [centre_bottom], 2, base)
    for curves, parts in ((arcs_bottom, BOTTOM_PARTS), (arcs_top, TOP_PARTS), (sides, SIDE_PARTS)):
        for curve in curves:
            gmsh.model.mesh.setTransfiniteCurve(curve, parts + 1)
    gmsh.model.mesh.generate(3)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    corners = gmsh.model.mesh.getElementsByType(4)[1]
    gmsh.finalize()
    tags = np.asarray(tags, int)
    order = np.argsort(tags)
    number = np.full(tags.max() + 1, -1)
    number[tags[order]] = np.arange(len(tags))
    x = np.asarray(xyz).reshape(-1, 3)[order]
    tets = number[np.asarray(corners, int).reshape(-1, 4)]
    turned = volumes(x, tets) < 0
    tets[turned] = tets[turned][:, [0, 2, 1, 3]]
    return x, tets


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


def improve(x, tets, wanted=25.0, rounds=20):
    """Hill climbing: a node of a poor tetrahedron moves to the trial with the largest smallest angle around the node.

    Nodes of the rims and of `POINTS` stay, other nodes of the base, the top and the wall move within them.
    """
    x = x.copy()
    random = np.random.RandomState(1)
    on_wall = np.abs(np.hypot(x[:, 0], x[:, 1]) - RADIUS) < 1e-3
    on_cap = (x[:, 2] < 1e-6) | (x[:, 2] > HEIGHT - 1e-6)
    stays = on_wall & on_cap
    for p in POINTS.values():
        stays |= np.linalg.norm(x - p, axis=1) < 1e-6
    for _ in range(rounds):
        for v in sorted(set(tets[min_dihedral(x, tets) < wanted].ravel().tolist())):
            if stays[v]:
                continue
            star = tets[(tets == v).any(axis=1)]
            best, place = min_dihedral(x, star).min(), x[v].copy()
            for trial in place + random.normal(size=(30, 3)) * random.uniform(0.02, 1.2, (30, 1)):
                if on_cap[v]:
                    trial[2] = place[2]
                if on_wall[v]:
                    trial[:2] *= RADIUS / np.hypot(*trial[:2])
                x[v] = trial
                worst = min_dihedral(x, star).min()
                if worst > best:
                    best, place = worst, trial
            x[v] = place
    return x


def rows_of(numbers, width=12):
    numbers = [str(int(n)) for n in numbers]
    return [", ".join(numbers[i:i + width]) for i in range(0, len(numbers), width)]


def write(x, tets):
    lines = ["*HEADING", "Cylinder of Zhong et al. 2005 (radius 30, height 20, base held), made by make_cylinder.py",
             f"** {len(x)} nodes, {len(tets)} tetrahedra; the paper states no units", "*NODE, NSET=NALL"]
    lines += [f"{i}, {p[0]:.4f}, {p[1]:.4f}, {p[2]:.4f}" for i, p in enumerate(x, 1)]
    lines.append("*ELEMENT, TYPE=C3D4, ELSET=CYLINDER")
    lines += [f"{i}, {t[0]}, {t[1]}, {t[2]}, {t[3]}" for i, t in enumerate((tets + 1).tolist(), 1)]
    lines += ["*NSET, NSET=FIXED"] + rows_of(np.flatnonzero(x[:, 2] == 0) + 1)
    for name, p in POINTS.items():
        lines += [f"*NSET, NSET={name}", str(int(np.linalg.norm(x - p, axis=1).argmin()) + 1)]
    lines += ["** mu, lambda of the paper's eq. (1)", "*MATERIAL, NAME=TISSUE",
              "*HYPERELASTIC, COMPRESSIBLE NEO HOOKE", f"{LAW[0]}, {LAW[1]}",
              "*SOLID SECTION, ELSET=CYLINDER, MATERIAL=TISSUE", "*BOUNDARY", "FIXED, 1, 3"]
    (HERE / "cylinder.inp").write_text("\n".join(lines) + "\n")
    lines = ["** The cylinder pushed at P1 by the first of the paper's ten forces, (0, 0, -8)",
             "*INCLUDE, INPUT=cylinder.inp", "*STEP, NLGEOM=YES", "*STATIC", "*CLOAD", "P1, 3, -8.0", "*END STEP"]
    (HERE / "cylinder_push.inp").write_text("\n".join(lines) + "\n")


def check():
    nodes, tets, sets, card = [], [], {}, ""
    for line in (HERE / "cylinder.inp").read_text().splitlines():
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            card = line
            continue
        fields = line.split(",")
        if card.startswith("*NODE"):
            nodes.append([float(f) for f in fields[1:]])
            assert int(fields[0]) == len(nodes)
        elif card.startswith("*ELEMENT"):
            tets.append([int(f) - 1 for f in fields[1:]])
        elif card.startswith("*NSET"):
            sets.setdefault(card.split("NSET=")[1], []).extend(int(f) - 1 for f in fields)
    x, tets = np.array(nodes), np.array(tets)
    quality = min_dihedral(x, tets)
    faces = np.sort(np.vstack([tets[:, f] for f in ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))]), axis=1)
    faces, counts = np.unique(faces, axis=0, return_counts=True)
    outer = faces[counts == 1]
    edges = np.unique(np.vstack([outer[:, [0, 1]], outer[:, [1, 2]], outer[:, [0, 2]]]), axis=0)
    h = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1).mean()
    for name, value in (("nodes", len(x)), ("tetrahedra", len(tets)), ("free", len(x) - len(sets["FIXED"])),
                        ("fixed", len(sets["FIXED"])), ("surface", len(np.unique(outer))), ("h", round(float(h), 3)),
                        ("volume", round(float(volumes(x, tets).sum()), 1)),
                        ("min_dihedral", round(float(quality.min()), 2)),
                        ("labels", {n: sets[n][0] + 1 for n in POINTS})):
        print(f"{name:14} {value}")
    assert len(x) == NUM_NODES and len(tets) == NUM_TETRAHEDRA
    assert quality.min() > 10 and volumes(x, tets).min() > 0
    assert len(np.unique(tets)) == len(x) and counts.max() == 2
    assert sorted(sets["FIXED"]) == np.flatnonzero(x[:, 2] == 0).tolist()
    for name, p in POINTS.items():
        assert len(sets[name]) == 1 and tuple(x[sets[name][0]]) == p, name


def main():
    if "--check" not in sys.argv[1:]:
        x, tets = make_mesh()
        write(np.round(improve(x, tets), 4) + 0.0, tets)
    check()


if __name__ == "__main__":
    main()
