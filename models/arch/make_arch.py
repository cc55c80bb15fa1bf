#!/usr/bin/python3
"""Makes arch.inp and arch_snap.inp: a shallow clamped arch that snaps through under a load at its crown.

    /usr/bin/python3 make_arch.py            writes both files beside this script
    /usr/bin/python3 make_arch.py --check    checks that the files match what this script would write

Half of a circular arch, from the clamp to the plane of symmetry x = 0: cells along the arch, each cut into six ten-node
tetrahedra, with middle nodes on the arc. y is held everywhere, so the arch stays in its plane. Units: mm, mN, so kPa.
Needs nothing but Python.
"""

import math
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
RADIUS, HALF_ANGLE, THICKNESS, WIDTH = 50.0, 0.2, 0.5, 0.5
CELLS = 20  # along the half; one across and one through
LAW = (500.0, 0.0)  # mu, lambda of eq. (1): Young's modulus 1000, Poisson's ratio 0
FORCE = 0.1  # on the half, at the load factor 1
AROUND_DIAGONAL = ((0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7))
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))


def mesh():
    """Nodes as half cells (i, j, k) along, across, through; elements as ten of them; the faces on the crown."""
    elements = []
    for cell in range(CELLS):
        corners = [(2 * (cell + (c & 1)), 2 * (c >> 1 & 1), 2 * (c >> 2)) for c in range(8)]
        for tetrahedron in AROUND_DIAGONAL:
            nodes = [corners[c] for c in tetrahedron]
            nodes += [tuple((a + b) // 2 for a, b in zip(nodes[e], nodes[f])) for e, f in EDGES]
            elements.append(nodes)
    crown = []
    for number, nodes in enumerate(elements, 1):
        for face, corners in enumerate(((0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)), 1):
            if all(nodes[c][0] == 2 * CELLS for c in corners):
                crown.append((number, face))
    return sorted({node for nodes in elements for node in nodes}), elements, crown


def position(node):
    along, across, through = node
    angle = HALF_ANGLE * (1 - along / (2 * CELLS))
    radius = RADIUS + (through / 2 - 0.5) * THICKNESS
    return (-radius * math.sin(angle) + 0.0, across / 2 * WIDTH, radius * math.cos(angle))


def labels_of(nodes, keep):
    labels = [str(label) for label, node in enumerate(nodes, 1) if keep(node)]
    return "\n".join(", ".join(labels[i:i + 12]) for i in range(0, len(labels), 12))


def arch():
    nodes, elements, crown = mesh()
    label = {node: i for i, node in enumerate(nodes, 1)}
    middle = label[(2 * CELLS, 0, 1)]
    text = ["*HEADING", "Half of a shallow clamped arch, made by make_arch.py; mm, mN, kPa", "*NODE, NSET=NALL"]
    text += [f"{label[node]}, " + ", ".join(f"{x:.12g}" for x in position(node)) for node in nodes]
    text.append("*ELEMENT, TYPE=C3D10, ELSET=ARCH")
    for number, element in enumerate(elements, 1):
        text.append(f"{number}, " + ", ".join(str(label[node]) for node in element))
    text += ["*NSET, NSET=CLAMP", labels_of(nodes, lambda node: node[0] == 0),
             "*NSET, NSET=CROWN", labels_of(nodes, lambda node: node[0] == 2 * CELLS),
             "** on the axis of the arch, in the plane of symmetry", "*NSET, NSET=MIDDLE", str(middle),
             "*SURFACE, NAME=CUT"]
    text += [f"{number}, S{face}" for number, face in crown]
    text += ["*MATERIAL, NAME=RUBBER", "*HYPERELASTIC, COMPRESSIBLE NEO HOOKE", f"{LAW[0]:g}, {LAW[1]:g}",
             "*SOLID SECTION, ELSET=ARCH, MATERIAL=RUBBER", "*BOUNDARY", "CLAMP, 1, 3", "NALL, 2, 2", "CROWN, 1, 1"]
    return "\n".join(text) + "\n", middle


def snap(middle):
    return f"""*HEADING
The arch pushed down at its crown: it snaps through at a load factor of 0.55, and would come up again at 0.48
*INCLUDE, INPUT=arch.inp
*STEP, NLGEOM
*STATIC, RIKS
** arc lengths: first, total, smallest, largest; then the largest load factor; the node, dof and displacement where it ends
0.05, 1, , 0.25, , {middle}, 3, -1.6
** {FORCE:g} mN on the half, along -z, as a shear of its cut
*DSLOAD, FOLLOWER=NO, CONSTANT RESULTANT=YES
CUT, TRVEC, {FORCE / (THICKNESS * WIDTH):g}, 0, 0, -1
*NODE PRINT, NSET=MIDDLE
U
*END STEP
"""


def main():
    text, middle = arch()
    files = {"arch.inp": text, "arch_snap.inp": snap(middle)}
    for name, content in files.items():
        if "--check" in sys.argv[1:]:
            if (HERE / name).read_text() != content:
                sys.exit(f"{HERE / name}: not what make_arch.py writes")
        else:
            (HERE / name).write_text(content)
    nodes, elements, _ = mesh()
    print(f"arch: {len(nodes)} nodes, {len(elements)} tetrahedra")


main()
