#!/usr/bin/env python3
"""One nonlinear solve of the brain by `palpate solve` and by CalculiX, side by side on the same file.

The push of models/brain/brain_push.inp, with a law of both programs (NEO HOOKE, the shipped small-strain moduli). Each
program runs with its default settings: ours converges to 1e-10 of the force, CalculiX to half a percent.

Times are medians of whole processes, and of the solution: from summary.json for ours, minus a run with *NO ANALYSIS for
CalculiX. Prints Markdown.

Example: bench/solver/against_calculix.py build/release/bin/palpate build/validation
"""
import argparse
import json
import os
import pathlib
import re
import statistics
import subprocess
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
DEPTHS = {"1 h": 1.0, "2 h": 2.0, "2.2 h, where the smallest J is 0.3": 2.2}  # |d| in mean edges
CALCULIX = {"ccx, direct (SPOOLES)": "SPOOLES", "ccx, iterative (scaling)": "ITERATIVE SCALING",
            "ccx, iterative (Cholesky)": "ITERATIVE CHOLESKY"}


def neo_hooke(match):
    mu, lam = (float(field) for field in match.group(1).split(","))
    return f"*HYPERELASTIC, NEO HOOKE\n{mu / 2}, {2 / (lam + 2 / 3 * mu)}\n"


def brain_model(depth):
    """(bulk, step): the mesh with its material, and the push by `depth` mean edges."""
    mesh = (ROOT / "models/brain/brain.inp").read_text()
    mesh = re.sub(r"\*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n(.*)\n", neo_hooke, mesh)
    push = (ROOT / "models/brain/brain_push.inp").read_text()
    sets = re.search(r"\*NSET, NSET=PUSH\n(.*\n)+?(?=\*)", push).group(0)
    motions = re.findall(r"PUSH, (\d), \d, (\S+)", push)
    step = "*BOUNDARY\n" + "".join(f"PUSH, {axis}, {axis}, {depth * float(value)}\n" for axis, value in motions)
    return mesh + sets, step + "*NODE PRINT, NSET=PUSH\nRF\n*END STEP\n"


def block_model(cells):
    """A block of cells^3 cubes, six tetrahedra each, on a fixed base, a patch in the middle of its top pushed in."""
    side = cells + 1
    label = lambda i, j, k: 1 + i + side * (j + side * k)
    lines = ["*NODE"]
    grid = [(i, j, k) for k in range(side) for j in range(side) for i in range(side)]
    lines += [f"{label(i, j, k)}, {i}, {j}, {k}" for i, j, k in grid]
    lines += ["*ELEMENT, TYPE=C3D4, ELSET=E"]
    around_diagonal = [(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)]
    number = 0
    for i, j, k in grid:
        if max(i, j, k) == cells:
            continue
        corner = [label(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)) for c in range(8)]
        for tetrahedron in around_diagonal:
            number += 1
            lines.append(f"{number}, " + ", ".join(str(corner[c]) for c in tetrahedron))
    middle = cells // 2
    patch = [label(middle + i, middle + j, cells) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    lines += ["*NSET, NSET=BASE, GENERATE", f"1, {side * side}", "*NSET, NSET=PUSH", ", ".join(map(str, patch)),
              "*MATERIAL, NAME=M", "*HYPERELASTIC, NEO HOOKE", f"0.5, {2 / (4 + 2 / 3)}",
              "*SOLID SECTION, ELSET=E, MATERIAL=M", "*BOUNDARY", "BASE, 1, 3", ""]
    return "\n".join(lines), "*BOUNDARY\nPUSH, 1, 2\nPUSH, 3, 3, -1\n*NODE PRINT, NSET=PUSH\nRF\n*END STEP\n"


def timed(command, folder):
    """(seconds, peak bytes, exit code, output) of one run."""
    with open(folder / "log.txt", "w+") as log:
        start = time.perf_counter()
        threads = {"OMP_NUM_THREADS": str(len(os.sched_getaffinity(0)))}  # CalculiX takes one core unless told
        process = subprocess.Popen(command, cwd=folder, stdout=log, stderr=subprocess.STDOUT, env=os.environ | threads)
        _, status, usage = os.wait4(process.pid, 0)
        seconds = time.perf_counter() - start
        log.seek(0)
        return seconds, 1024 * usage.ru_maxrss, os.waitstatus_to_exitcode(status), log.read()


def write_inputs(folder, model, solvers):
    bulk, step = model
    (folder / "ours.inp").write_text(bulk + "*STEP, NLGEOM, INC=1000\n*STATIC\n1, 1\n" + step)
    (folder / "nothing.inp").write_text(bulk + "*STEP, NLGEOM, INC=1000\n*NO ANALYSIS\n" + step)
    for number, name in enumerate(solvers):
        (folder / f"theirs{number}.inp").write_text(
            bulk + f"*STEP, NLGEOM, INC=1000\n*STATIC, SOLVER={CALCULIX[name]}\n1, 1\n" + step)


def run_palpate(program, folder):
    """One run: (seconds of the process, of the solution, peak bytes, whether it solved, its own message)."""
    seconds, memory, code, _ = timed([program, "solve", "ours.inp", "-o", "ours", "--json"], folder)
    summary = json.loads((folder / "ours/summary.json").read_text())
    last = summary["steps"][-1]
    parts = ", ".join(f"{name.replace('_', ' ')} {seconds:.3f}" for name, seconds in summary["seconds"].items())
    note = (f"{last['increments']} increments, {last['iterations']} iterations, {last['factorizations']} factors, "
            f"min J {last['min_J']:.2f}; {parts} s")
    return seconds, summary["seconds"]["analysis"] + last["seconds"], memory, code == 0, note


def run_calculix(number, reading, folder):
    seconds, memory, _, output = timed(["ccx", f"theirs{number}"], folder)
    finished = "Job finished" in output
    iterations = len(re.findall(r"^ iteration ", output, re.M))
    cutbacks = len(re.findall(r"the increment is reattempted", output))
    note = f"{iterations} iterations, {cutbacks} cutbacks" + ("" if finished else "; gave up")
    return seconds, seconds - reading, memory, finished, note


def table(title, model, folder, program, rounds, solvers):
    """Each round runs every program once, so that other load on the machine falls on all alike."""
    print(f"{title}\n\n| program | whole process, s | against ours | solution, s | against ours | peak memory, MB | |\n"
          "|:--|--:|--:|--:|--:|--:|:--|")
    folder.mkdir(parents=True, exist_ok=True)
    write_inputs(folder, model, solvers)
    runs = {name: [] for name in ("palpate solve", *solvers)}
    for _ in range(rounds):
        runs["palpate solve"].append(run_palpate(program, folder))
        reading = timed(["ccx", "nothing"], folder)[0]
        for number, name in enumerate(solvers):
            runs[name].append(run_calculix(number, reading, folder))
    median = {name: [statistics.median(run[column] for run in of_program) for column in (0, 1)]
              for name, of_program in runs.items()}
    ours = median["palpate solve"]
    for name, (whole, solution) in median.items():
        _, _, memory, solved, note = runs[name][-1]
        failed = "" if solved else " (not solved)"
        print(f"| {name} | {whole:.2f}{failed} | {whole / ours[0]:.1f} | {solution:.2f} | {solution / ours[1]:.1f} | "
              f"{memory / 1e6:.0f} | {note} |")
    print(flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the palpate program")
    parser.add_argument("folder", type=pathlib.Path, help="where the runs leave their files")
    parser.add_argument("--rounds", type=int, default=7, help="runs of each, in turn, of which the median counts (default 7)")
    arguments = parser.parse_args()
    program = str(pathlib.Path(arguments.program).resolve())
    with open("/proc/cpuinfo") as cpuinfo:
        processor = re.search(r"model name\s*: (.*)", cpuinfo.read()).group(1)
    print(f"On {len(os.sched_getaffinity(0))} cores of {processor}.\n")
    for name, depth in DEPTHS.items():
        table(f"The brain, 3,924 nodes and 19,734 tetrahedra, pushed to {name}:", brain_model(depth),
              arguments.folder / "calculix", program, arguments.rounds, CALCULIX)
    table("A block of 21,952 nodes and 118,098 tetrahedra, a patch pushed in by one edge:", block_model(27),
          arguments.folder / "calculix", program, 1, ["ccx, iterative (scaling)"])


if __name__ == "__main__":
    main()
