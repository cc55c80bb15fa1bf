"""Checks that brain.inp holds the promises of models/README.md, and prints its figures."""

from pathlib import Path

import numpy as np

from brain_tetrahedra import mean_edge, min_dihedral, outer_triangles, volumes

HERE = Path(__file__).resolve().parent
NUM_FREE = 2886         # free nodes of the paper's brain
NUM_NODES = 3921        # all nodes of the paper's brain, to be met within 3 %


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
    # Tetrahedron edges connect the free nodes, and so for the fixed nodes.
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
