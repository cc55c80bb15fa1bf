#!/usr/bin/python3
"""Errors of nonlinear zones on the brain at several Poisson's ratios, for one and several contacts.

Builds the scene with other lambdas, reaches (one and two mean surface edges h) and rings. Writes the tables of the packs'
surveys to DIR/one.md and DIR/several.md.

    bench/zones/zone_ratios.py PALPATE SCENE DIR [--quadratic]

--quadratic: the same at nu = 0.49 on elements of ten nodes, at eight sites, to DIR/one_quadratic.md and
DIR/several_quadratic.md (an hour)
"""
import json
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))
from model_variants import edge_of, quadratic, with_ratio, with_settings  # noqa: E402

# Poisson's ratio, rings, reach in h.
CASES = [(ratio, rings, reach) for reach in (1, 2) for rings in (1, 2, 3) for ratio in (0.147, 0.4, 0.45)]
CASES.insert(6, (0.49, 2, 1))
SITES_QUADRATIC = [711, 713, 716, 719, 721, 770, 772, 775]
FIGURES = "median | p95 | max | force, median | p95 | max |"


def surveyed(program, scene, folder, name, model, rings, reach):
    """The errors of a pack with zones, from `palpate info`."""
    (folder / f"{name}.inp").write_text(model)
    scene = with_settings(scene, {"model": f'"{name}.inp"', "zone_rings": rings,
                                  "max_displacement": f"{reach * edge_of(scene):.6g}"})
    files = [folder / f"{name}_{rings}_{reach}h{suffix}" for suffix in (".toml", ".pack")]
    files[0].write_text(scene)
    subprocess.run([program, "build", files[0], "-o", files[1], "--samples", folder / "samples"], check=True)
    about = subprocess.run([program, "info", files[1], "--json"], check=True, capture_output=True).stdout
    return json.loads(about)["errors"]["nonlinear_zone"]


def percents(errors):
    return " | ".join(f"{100 * errors[of][value]:.3g}"
                      for of in ("displacement", "force") for value in ("median", "p95", "max"))


def rows_of_several(start, errors):
    for kind in errors["several"]:
        where = "near" if kind["near"] else "anywhere" if kind["contacts"] == 2 else "apart"
        yield (f"{start} {kind['contacts']} {where} | {kind['sets']} | {kind['flagged']} | "
               f"{kind['without_equilibrium']} | {percents(kind)} |")


def main():
    program, scene_file, folder = sys.argv[1], *map(pathlib.Path, sys.argv[2:4])
    folder.mkdir(parents=True, exist_ok=True)
    scene = scene_file.read_text()
    model = (scene_file.parent / re.search(r'model = "([^"]*)"', scene)[1]).read_text()
    cases = [(ratio, f"brain{ratio}", with_ratio(model, ratio), rings, reach) for ratio, rings, reach in CASES]
    suffix = ""
    if "--quadratic" in sys.argv:
        scene = scene.replace('sites = "PROBE"', f"sites = {SITES_QUADRATIC}")
        cases = [("0.49, ten nodes", "quadratic", quadratic(with_ratio(model, 0.49)), 2, 1)]
        suffix = "_quadratic"
    tables = {"one": [f"| nu | rings | to | pushes | {FIGURES}", "|" + "---|" * 10],
              "several": [f"| nu | rings | to | contacts | sets | flagged | no equilibrium | {FIGURES}", "|" + "---|" * 13]}
    one, several = tables.values()
    for ratio, name, variant, rings, reach in cases:
        errors = surveyed(program, scene, folder, name, variant, rings, reach)
        start = f"| {ratio} | {rings} | {reach} h |"
        one.append(f"{start} {errors['overall']['samples']} | {percents(errors['overall'])} |")
        several += rows_of_several(start, errors)
        for table, rows in tables.items():  # so far: a case takes minutes
            (folder / f"{table}{suffix}.md").write_text("\n".join(rows) + "\n")
    print("\n".join(one + several))


if __name__ == "__main__":
    main()
