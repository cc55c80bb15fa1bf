#!/usr/bin/python3
"""Makes brain.inp and brain_push.inp: a brain phantom of about 3,921 nodes, 2,886 of them free, with a stiff inclusion.

    /usr/bin/python3 make_brain.py            writes both files beside this script, then checks them
    /usr/bin/python3 make_brain.py --check    checks the files that are there

How. The shape is the zero level of a function `shape` (negative inside): two ellipsoidal hemispheres, temporal lobes,
a brain stem and a cerebellum, a flat base, a longitudinal fissure cut from above, and sulci along the zero lines of a
band-limited random field. Marching tetrahedra on a coarse grid give a first surface; splitting, collapsing, flipping
and tangential smoothing (Botsch and Kobbelt, A remeshing approach to multiresolution modeling, 2004) give it edges of
one length, each vertex kept on the zero level; Gmsh fills it with tetrahedra; a last pass moves single nodes where a
dihedral angle is small. Everything is seeded and single-threaded: two runs on one machine write the same bytes.

Needs Debian's python3-gmsh (4.8.4) and python3-numpy. Axes: x to one side, y to the front, z up, millimetres.
"""

import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
EDGE = 8.1              # mm, wanted length of a surface edge
INTERIOR_EDGE = 6.55    # mm, wanted length of an edge inside
GRID = 4.0              # mm, step of the marching grid
NUM_FREE = 2886         # free nodes of the paper's brain
NUM_NODES = 3921        # all nodes of the paper's brain, to be met within 3 %
NUM_PROBE = 60          # touchable nodes
SULCUS_DEPTH = 6.5      # mm
SULCUS_WIDTH = 6.0      # mm, half width at 1/e of the depth
PROBE_CENTRE = (34.0, 10.0, 110.0)  # mm; the site nearest this point is the middle of the PROBE region
INCLUSION_DEPTH = 16.0  # mm from that node to the inclusion's centre, along the inward normal
INCLUSION_RADIUS = 6.5  # mm; a tetrahedron belongs to it if its centroid is inside
TIP_RADIUS = 10.0       # mm along the surface, as in brain.toml: the patch that brain_push.inp moves
TISSUE_LAW = (1.0, 4.0)      # mu, lambda in mN/mm^2 (kPa)
INCLUSION_LAW = (5.0, 20.0)


# ---------------------------------------------------------------------------------------------------------------- shape
def smooth_min(a, b, k):
    """Minimum with a blend of width k: a smooth union."""
    h = np.maximum(k - np.abs(a - b), 0) / k
    return np.minimum(a, b) - h * h * k / 4


def smooth_max(a, b, k):
    return -smooth_min(-a, -b, k)


def ellipsoid(p, centre, semi):
    """First-order distance to an ellipsoid, negative inside."""
    q = (p - centre) / semi
    k0 = np.linalg.norm(q, axis=1)
    k1 = np.linalg.norm(q / semi, axis=1)
    return k0 * (k0 - 1) / np.maximum(k1, 1e-9)


_random = np.random.RandomState(7)
_WAVES = _random.normal(size=(24, 3))
_WAVES *= (2 * np.pi / _random.uniform(44, 58, 24) / np.linalg.norm(_WAVES, axis=1))[:, None]
_PHASES = _random.uniform(0, 2 * np.pi, 24)


def folds(p):
    """Depth of the sulci, mm: troughs along the zero lines of a random field of wavelength about 50 mm.

    The field is read at the point's central projection onto an ellipsoid, so a sulcus goes straight down and never
    undercuts the surface.
    """
    q = (p - (0.0, 0.0, 45.0)) / (71.0, 86.0, 62.0)
    q = q / np.maximum(np.linalg.norm(q, axis=1), 1e-6)[:, None] * (71.0, 86.0, 62.0)
    angle = q @ _WAVES.T + _PHASES
    slope = np.linalg.norm(np.sin(angle) @ _WAVES, axis=1)
    distance = np.cos(angle).sum(axis=1) / np.maximum(slope, 0.15)  # mm, to first order, to the nearest zero line
    return SULCUS_DEPTH * np.exp(-(distance / SULCUS_WIDTH) ** 2)


def shape(p):
    side = np.abs(p[:, 0])
    m = np.column_stack([side, p[:, 1], p[:, 2]])
    # Narrower at the front: scale x by a factor of y.
    m[:, 0] = side / (1 - 0.0016 * p[:, 1] - 0.000008 * p[:, 1] ** 2)
    cerebrum = ellipsoid(m, (22.0, 0.0, 54.0), (50.0, 86.0, 57.0))
    temporal = ellipsoid(m, (44.0, 16.0, 24.0), (23.0, 42.0, 20.0))
    # Under the cerebrum the front and the back rise; the temporal lobe hangs below, parted by the lateral fissure.
    floor = 20 + 0.0022 * p[:, 1] ** 2 - p[:, 2]
    cerebrum = smooth_max(cerebrum, floor, 16)
    f = smooth_min(cerebrum, temporal, 3)
    # The lateral (Sylvian) fissure: a groove rising backwards on the flank.
    lateral = p[:, 2] - (40 - 0.30 * (p[:, 1] - 16))
    reach = 1 / (1 + np.exp(-(side - 44) / 3)) / (1 + np.exp(-(p[:, 1] + 24) / 4))
    f = f + 8.0 * np.exp(-(lateral / 5.5) ** 2) * reach
    on_cortex = 1 / (1 + np.exp(-(p[:, 2] - 22) / 5))
    f = f + folds(p) * on_cortex
    # The longitudinal fissure: a slot whose floor is highest in the middle.
    bottom = 62 - 0.0052 * p[:, 1] ** 2
    half_gap = 3.0 + 0.035 * np.maximum(p[:, 2] - bottom, 0)
    slot = smooth_max(side - half_gap, bottom - p[:, 2], 5)
    f = smooth_max(f, -slot, 6)
    # Brain stem and cerebellum, then the flat base.
    f = smooth_min(f, ellipsoid(m, (17.0, -50.0, 18.0), (28.0, 26.0, 19.0)), 3)
    f = smooth_min(f, ellipsoid(m, (0.0, -14.0, 18.0), (20.0, 24.0, 40.0)), 6)
    return smooth_max(f, -p[:, 2], 5)


def gradient(p, step=0.05):
    g = np.empty_like(p)
    for axis in range(3):
        e = np.zeros(3)
        e[axis] = step
        g[:, axis] = (shape(p + e) - shape(p - e)) / (2 * step)
    return g


def project(p, rounds=6):
    """Moves points to the zero level along the gradient, at most 1.5 mm a round."""
    p = np.array(p, float)
    for _ in range(rounds):
        f, g = shape(p), gradient(p)
        move = -(f / np.maximum((g * g).sum(axis=1), 0.05))[:, None] * g
        length = np.linalg.norm(move, axis=1)
        p += move * np.minimum(1, 1.5 / np.maximum(length, 1e-12))[:, None]
    return p


# -------------------------------------------------------------------------------------------------------------- surface
def marching_tetrahedra():
    """Triangles of the zero level on a grid of cubes, each cut into six tetrahedra around its diagonal."""
    axes = [np.arange(lo, hi, GRID) for lo, hi in ((-86.3, 88), (-101.7, 103), (-11.3, 126))]
    shape3 = tuple(len(a) for a in axes)
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    value = shape(points)
    cell = np.stack(np.meshgrid(*[np.arange(n - 1) for n in shape3], indexing="ij"), -1).reshape(-1, 3)
    stride = np.array([shape3[1] * shape3[2], shape3[2], 1])
    vertices, index, triangles = [], {}, []

    def cut(a, b):
        key = (a, b) if a < b else (b, a)
        if key not in index:
            index[key] = len(vertices)
            t = value[a] / (value[a] - value[b])
            t = min(max(t, 0.02), 0.98)
            vertices.append(points[a] + t * (points[b] - points[a]))
        return index[key]

    for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
        corner = [cell @ stride]
        for axis in order:
            corner.append(corner[-1] + stride[axis])
        tets = np.stack(corner, 1)
        inside = value[tets] < 0
        some = inside.any(axis=1) & ~inside.all(axis=1)
        for tet, flags in zip(tets[some].tolist(), inside[some].tolist()):
            a = [v for v, i in zip(tet, flags) if i]
            b = [v for v, i in zip(tet, flags) if not i]
            if len(a) == 2:
                loop = [cut(a[0], b[0]), cut(a[0], b[1]), cut(a[1], b[1]), cut(a[1], b[0])]
                new = [(loop[0], loop[1], loop[2]), (loop[0], loop[2], loop[3])]
            else:
                new = [tuple(cut(i, o) for i in a for o in b)]
            outward = points[b].mean(axis=0) - points[a].mean(axis=0)
            for t in new:
                p, q, r = (vertices[i] for i in t)
                triangles.append(t if np.cross(q - p, r - p) @ outward > 0 else (t[0], t[2], t[1]))
    return np.array(vertices), largest_component(np.array(triangles))


def largest_component(triangles):
    parent = list(range(int(triangles.max()) + 1))

    def root(i):
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for a, b, c in triangles.tolist():
        parent[root(a)] = root(b)
        parent[root(b)] = root(c)
    label = np.array([root(a) for a in triangles[:, 0].tolist()])
    names, counts = np.unique(label, return_counts=True)
    return triangles[label == names[counts.argmax()]]


class Surface:
    """A closed triangle mesh that is edited in place. `around[v]` holds the triangles of vertex v."""

    def __init__(self, points, triangles):
        self.x = [tuple(p) for p in points.tolist()]
        self.triangles = {i: tuple(t) for i, t in enumerate(triangles.tolist())}
        self.around = [set() for _ in self.x]
        for i, t in self.triangles.items():
            for v in t:
                self.around[v].add(i)
        self.next = len(self.triangles)

    def edges(self):
        return sorted({(min(a, b), max(a, b)) for t in self.triangles.values() for a, b in zip(t, t[1:] + t[:1])})

    def length2(self, a, b):
        p, q = self.x[a], self.x[b]
        return (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2

    def normal(self, t, moved=None, place=None):
        p, q, r = (place if v == moved else self.x[v] for v in t)
        a = (q[0] - p[0], q[1] - p[1], q[2] - p[2])
        b = (r[0] - p[0], r[1] - p[1], r[2] - p[2])
        return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])

    def neighbours(self, v):
        return {w for t in self.around[v] for w in self.triangles[t]} - {v}

    def remove(self, i):
        for v in self.triangles.pop(i):
            self.around[v].discard(i)

    def add(self, t):
        self.triangles[self.next] = t
        for v in t:
            self.around[v].add(self.next)
        self.next += 1

    def split_long(self, limit):
        for a, b in sorted(self.edges(), key=lambda e: (-self.length2(*e), e)):
            both = sorted(self.around[a] & self.around[b])
            if self.length2(a, b) <= limit * limit or len(both) != 2:
                continue
            m = len(self.x)
            self.x.append(tuple((p + q) / 2 for p, q in zip(self.x[a], self.x[b])))
            self.around.append(set())
            for i in both:
                t = self.triangles[i]
                self.remove(i)
                self.add(tuple(m if v == b else v for v in t))
                self.add(tuple(m if v == a else v for v in t))

    def collapse_short(self, limit, longest):
        for a, b in sorted(self.edges(), key=lambda e: (self.length2(*e), e)):
            both = self.around[a] & self.around[b]
            if not both or self.length2(a, b) >= limit * limit:
                continue
            if len(both) != 2 or len(self.neighbours(a) & self.neighbours(b)) != 2:
                continue
            place = tuple((p + q) / 2 for p, q in zip(self.x[a], self.x[b]))
            if any(sum((p - q) ** 2 for p, q in zip(place, self.x[w])) > longest * longest
                   for w in self.neighbours(a) | self.neighbours(b) if w not in (a, b)):
                continue
            if not all(self.keeps_normal(i, v, place) for v in (a, b) for i in self.around[v] - both):
                continue
            for i in sorted(both):
                self.remove(i)
            for i in sorted(self.around[b]):
                t = self.triangles[i]
                self.remove(i)
                self.add(tuple(a if v == b else v for v in t))
            self.x[a] = place

    def keeps_normal(self, i, v, place):
        n, m = self.normal(self.triangles[i]), self.normal(self.triangles[i], v, place)
        dot = sum(p * q for p, q in zip(n, m))
        return dot > 0.4 * (sum(p * p for p in n) * sum(q * q for q in m)) ** 0.5

    def flip_edges(self):
        """Turns an edge if that brings the four valences nearer to six and bends the surface no more."""
        for a, b in self.edges():
            both = sorted(self.around[a] & self.around[b])
            if len(both) != 2:
                continue
            t = self.triangles[both[0]]
            k = t.index(a)
            first, second = (0, 1) if t[(k + 1) % 3] == b else (1, 0)
            c = next(v for v in self.triangles[both[first]] if v not in (a, b))
            d = next(v for v in self.triangles[both[second]] if v not in (a, b))
            if c == d or d in self.neighbours(c):
                continue
            count = [len(self.around[v]) for v in (a, b, c, d)]
            before = sum((n - 6) ** 2 for n in count)
            after = sum((n + s - 6) ** 2 for n, s in zip(count, (-1, -1, 1, 1)))
            if after >= before or min(count[0], count[1]) <= 4:
                continue
            new = [(c, a, d), (d, b, c)]
            old = [np.array(self.normal(self.triangles[i])) for i in both]
            mean = old[0] + old[1]
            normals = [np.array(self.normal(t)) for t in new]
            if all(n @ mean > 0.6 * np.linalg.norm(n) * np.linalg.norm(mean) for n in normals):
                for i in both:
                    self.remove(i)
                for t in new:
                    self.add(t)

    def smooth(self):
        """Moves each vertex towards the mean of its neighbours within the tangent plane, then onto the zero level."""
        used = [v for v, s in enumerate(self.around) if s]
        x = np.array([self.x[v] for v in used])
        mean = np.array([np.mean([self.x[w] for w in sorted(self.neighbours(v))], axis=0) for v in used])
        n = gradient(x)
        n /= np.linalg.norm(n, axis=1)[:, None]
        step = mean - x
        step -= (step * n).sum(axis=1)[:, None] * n
        for v, p in zip(used, project(x + 0.6 * step, 3)):
            self.x[v] = tuple(p.tolist())

    def arrays(self):
        used = sorted(v for v, s in enumerate(self.around) if s)
        number = {v: i for i, v in enumerate(used)}
        return (np.array([self.x[v] for v in used]),
                np.array([[number[v] for v in t] for _, t in sorted(self.triangles.items())]))


def make_surface():
    surface = Surface(*marching_tetrahedra())
    for _ in range(14):
        surface.split_long(EDGE * 4 / 3)
        surface.collapse_short(EDGE * 4 / 5, EDGE * 4 / 3)
        surface.flip_edges()
        surface.smooth()
    for _ in range(4):
        surface.flip_edges()
        surface.smooth()
    return surface.arrays()


# --------------------------------------------------------------------------------------------------------------- volume
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
    """Hill climbing on single nodes: a node of a poor tetrahedron moves to where the worst angle around it is largest.

    A surface node moves within the surface: each trial is put back on the zero level.
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


# ------------------------------------------------------------------------------------------------------------------ sets
def outer_triangles(tets):
    """Faces that belong to one tetrahedron, turned outwards."""
    faces = np.vstack([tets[:, f] for f in ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))])
    _, first, counts = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[counts == 1])]


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


def mean_edge(x, triangles):
    edges = np.unique(np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), 1), axis=0)
    return float(np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1).mean())


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


# ----------------------------------------------------------------------------------------------------------------- files
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


def read():
    """Nodes, tetrahedra (with the name of their set) and node sets of the written file."""
    nodes, tets, names, sets, card = [], [], [], {}, ""
    for line in (HERE / "brain.inp").read_text().splitlines():
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            card = line
            continue
        fields = [f.strip() for f in line.split(",")]
        if card.startswith("*NODE"):
            nodes.append([float(f) for f in fields[1:]])
            assert int(fields[0]) == len(nodes)
        elif card.startswith("*ELEMENT"):
            tets.append([int(f) - 1 for f in fields[1:]])
            names.append(card.split("ELSET=")[1])
        elif card.startswith("*NSET"):
            sets.setdefault(card.split("NSET=")[1], []).extend(int(f) - 1 for f in fields)
    return np.array(nodes), np.array(tets), np.array(names), {k: np.array(v) for k, v in sets.items()}


def pieces(groups):
    """Number of connected pieces of a list of index groups, and the labels they cover."""
    parent = {}

    def root(i):
        parent.setdefault(i, i)
        while parent[i] != i:
            i = parent[i]
        return i

    for group in groups:
        for v in group[1:]:
            parent[root(v)] = root(group[0])
        root(group[0])
    return len({root(i) for i in parent}), set(parent)


def within(groups, members):
    """Pieces of `members` joined by the edges of `groups` that lie in it."""
    members = set(members.tolist())
    pairs = [[v] for v in sorted(members)]
    for g in groups.tolist():
        pairs.extend([a, b] for i, a in enumerate(g) for b in g[:i] if a in members and b in members)
    return pieces(pairs)[0]


def check():
    x, tets, names, sets = read()
    triangles = outer_triangles(tets)
    surface = np.unique(triangles)
    quality = min_dihedral(x, tets)
    num_free = len(x) - len(sets["FIXED"])
    h = mean_edge(x, triangles)
    stiff = tets[names == "INCLUSION"]
    facts = dict(nodes=len(x), tetrahedra=len(tets), free=num_free, fixed=len(sets["FIXED"]), surface=len(surface),
                 surface_triangles=len(triangles), probe=len(sets["PROBE"]), stiff_tetrahedra=len(stiff),
                 stiff_volume_mm3=round(float(volumes(x, stiff).sum()), 1),
                 volume_mm3=round(float(volumes(x, tets).sum())),
                 h=round(h, 3), min_dihedral=round(float(quality.min()), 2),
                 dihedral_1_percent=round(float(np.percentile(quality, 1)), 2),
                 highest_fixed_z=round(float(x[sets["FIXED"], 2].max()), 2),
                 size=np.round(x.max(axis=0) - x.min(axis=0), 1).tolist())
    for name, value in facts.items():
        print(f"{name:20} {value}")
    assert abs(len(x) - NUM_NODES) <= 0.03 * NUM_NODES
    assert len(tets) >= 11700 and num_free == NUM_FREE
    assert volumes(x, tets).min() > 0 and quality.min() > 10
    assert len(np.unique(tets)) == len(x), "a node without a tetrahedron"
    assert np.array_equal(surface, np.sort(sets["SURFACE"]))
    edges = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    edges, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 2).all() and len(surface) - len(edges) + len(triangles) == 2, "the surface is not one sphere"
    assert x[sets["FIXED"], 2].max() <= np.delete(x[:, 2], sets["FIXED"]).min()
    assert not set(sets["PROBE"]) & set(sets["FIXED"]) and set(sets["PROBE"]) <= set(surface.tolist())
    # fixed nodes: every one hangs together with the others through tetrahedron edges, and so do the free ones
    free = np.setdiff1d(np.arange(len(x)), sets["FIXED"])
    print("pieces: fixed", within(tets, sets["FIXED"]), "free", within(tets, free),
          "probe", within(triangles, sets["PROBE"]))
    assert within(tets, free) == 1 and within(triangles, sets["PROBE"]) == 1
    faces = [tuple(sorted(t[list(f)].tolist())) for t in stiff for f in ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))]
    where = {}
    for i, f in enumerate(faces):
        where.setdefault(f, []).append(i // 4)
    assert pieces([g for g in where.values()])[0] == 1, "the inclusion is not one piece"
    assert not set(stiff.ravel().tolist()) & set(surface.tolist()), "the inclusion reaches the surface"
    return facts


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
