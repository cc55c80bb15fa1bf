"""Variants of the brain's model and scenes that studies build."""
import re


def with_ratio(model, ratio):
    """Materials `mu, lambda` of the model, lambda = 2 mu nu / (1 - 2 nu)."""

    def law(match):
        mu = float(match[2])
        return f"{match[1]}{mu!r}, {2 * mu * ratio / (1 - 2 * ratio)!r}"

    return re.sub(r"(\*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n)([\d.]+), *[\d.]+", law, model)


def with_settings(scene, settings):
    """A scene's lines `key = value`, each key exactly once, with other values."""
    for key, value in settings.items():
        scene, count = re.subn(rf'^{key} = ("[^"]*"|[\d.eE+-]+)', f"{key} = {value}", scene, flags=re.M)
        if count != 1:
            raise ValueError(f"the scene has {count} lines of {key}; it should have one")
    return scene


def edge_of(scene):
    """h, the largest displacement of the shipped scenes."""
    return float(re.search(r"^max_displacement = ([\d.eE+-]+)", scene, flags=re.M)[1])


def quadratic(model):
    """C3D10 from C3D4: a node in the middle of every edge, fixed if both ends are."""
    blocks = re.findall(r"(\*[^\n]*)\n((?:[^*][^\n]*\n?)*)", model)
    numbers = [[line.split(",") for line in body.splitlines()] for _, body in blocks]
    kinds = ["".join(head.upper().split()) for head, _ in blocks]
    positions = {int(row[0]): [float(x) for x in row[1:4]]
                 for kind, rows in zip(kinds, numbers) if re.fullmatch(r"\*NODE(,.*)?", kind) for row in rows}
    fixed = {int(label) for kind, rows in zip(kinds, numbers) if "NSET=FIXED" in kind and kind.startswith("*NSET")
             for row in rows for label in row if label.strip()}
    middles = {}

    def middle(a, b):
        return middles.setdefault((min(a, b), max(a, b)), max(positions) + 1 + len(middles))

    edges = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    bodies = [body.rstrip("\n") for _, body in blocks]
    for i, kind in enumerate(kinds):
        if kind.startswith("*ELEMENT,"):
            elements = [[int(x) for x in row] for row in numbers[i]]
            bodies[i] = "\n".join(", ".join(map(str, row + [middle(row[1 + a], row[1 + b]) for a, b in edges]))
                                  for row in elements)
    for i, kind in enumerate(kinds):
        if re.fullmatch(r"\*NODE(,.*)?", kind):
            for (a, b), label in middles.items():
                x = [(p + q) / 2 for p, q in zip(positions[a], positions[b])]
                bodies[i] += f"\n{label}, {x[0]:.12g}, {x[1]:.12g}, {x[2]:.12g}"
        elif kind.startswith("*NSET") and "NSET=FIXED" in kind:
            bodies[i] += "".join(f"\n{label}" for (a, b), label in middles.items() if a in fixed and b in fixed)
    return "\n".join(f"{head.replace('C3D4', 'C3D10')}\n{body}".rstrip("\n")
                     for (head, _), body in zip(blocks, bodies)) + "\n"
