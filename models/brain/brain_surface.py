"""A triangle mesh of the phantom's surface with edges of one length.

Marching tetrahedra on a coarse grid give a first mesh. Splitting, collapsing, flipping and tangential smoothing give
equal edges (Botsch and Kobbelt, A remeshing approach to multiresolution modeling, 2004). Vertices stay on the zero level.
"""

import numpy as np

from brain_shape import gradient, project, shape

EDGE = 8.1              # mm, wanted length of a surface edge
GRID = 4.0              # mm, step of the marching grid


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
        """Flips an edge if the flip brings the four valences nearer to six and bends the surface no more."""
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
