#!/usr/bin/python3
"""Makes the tables of docs/accuracy.md from the CSVs of a report on the shipped organs.

    bench/speed_error/accuracy_tables.py DIR LINKED     writes DIR/speed_error.md

DIR: the output of `palpate report -o DIR`; LINKED: the path of its stored copy, from docs/.
"""
import csv
import pathlib
import re
import sys

# Methods whose rows vary a setting if the pack lacks them.
SETTINGS = {"polynomial_dd", "nonlinear_zone"}
MOVING_PARTS = (0.5, 1.0)
MOVING = re.compile(r"nonlinear_zone, (\d) rings?, (\d) iterations? a frame")


def number(cell):
    """Three digits, never as a power of ten."""
    if not cell:
        return ""
    return f"{float(cell):.0f}" if float(cell) >= 1000 else f"{float(cell):.3g}"


def percent(cell):
    return f"{100 * float(cell):.2g}"


def spread(row, error):
    """'0.12 (0.05)': max and p95 in percent"""
    return f"{percent(row[error + '_max'])} ({percent(row[error + '_p95'])})"


def time(row, stage):
    """'1.2 (3.4)': median and p99.9"""
    median = row[stage + "_median_us"]
    return f"{number(median)} ({number(row[stage + '_p999_us'])})" if median else ""


def methods_of(rows, contacts):
    """The pack's own methods and their peers, in order, without varied settings."""
    names = []
    for row in rows:
        is_setting = row["carried"] == "0" and row["method"].split(",")[0] in SETTINGS
        if int(row["contacts"]) == contacts and not is_setting and row["method"] not in names:
            names.append(row["method"])
    return names


def level_name(row, by_strain):
    if by_strain:
        return f"{float(row['size_over_thickness']) * 100:.0f} % strain"
    return f"{float(row['size_over_h']):.2g} h"


def table(rows, contacts, by_strain):
    rows = [row for row in rows if int(row["contacts"]) == contacts]
    parts = sorted({float(row["part_of_max"]) for row in rows})
    level = {float(row["part_of_max"]): level_name(row, by_strain) for row in rows}
    heading = ["method", "forces, µs", "cold", "field, µs", "cold"]
    heading += [f"displacement error, {level[part]}" if part == parts[0] else level[part] for part in parts]
    heading += [f"force error, {level[part]}" if part == parts[0] else level[part] for part in parts]
    lines = ["| " + " | ".join(heading) + " |", "|---" + "|--:" * (len(heading) - 1) + "|"]
    for name in methods_of(rows, contacts):
        at = {float(row["part_of_max"]): row for row in rows if row["method"] == name}
        last = at[max(at)]
        exact = name.startswith("full Newton")
        cells = [name, time(last, "haptic"), number(last["haptic_cold_median_us"]), time(last, "visual"),
                 number(last["visual_cold_median_us"])]
        for error in ("displacement", "force"):
            cells += ["the truth" if exact else spread(at[part], error) if part in at else "" for part in parts]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def moving_zones(rows, contacts, parts):
    """Rings down, iterations a frame across: displacement errors at these parts of the reach, and the frame there."""
    cells = {}
    for row in rows:
        match = MOVING.fullmatch(row["method"])
        if match and int(row["contacts"]) == contacts and float(row["part_of_max"]) in parts:
            cell = f"{spread(row, 'displacement')} % {number(row['haptic_median_us'])} µs"
            cells.setdefault((int(match[1]), int(match[2])), []).append(cell)
    if not cells:
        return ""
    iterations = sorted({cell[1] for cell in cells})
    lines = ["| rings | " + " | ".join(f"{i} iteration{'s' if i > 1 else ''}" for i in iterations) + " |",
             "|--:" * (len(iterations) + 1) + "|"]
    for rings in sorted({cell[0] for cell in cells}):
        lines.append(f"| {rings} | " + " | ".join("; ".join(cells.get((rings, i), [])) for i in iterations) + " |")
    return "\n".join(lines)


def main():
    folder, linked = pathlib.Path(sys.argv[1]), sys.argv[2]
    with (folder / "about.csv").open(newline="") as file:
        about = {row["what"]: row["value"] for row in csv.DictReader(file)}
    text = (f"{about['processor']}, one thread, {about['compiler'].split(',')[0]}, {about['date']}, version {about['version']}, "
            f"seed {about['seed']}. Frames in µs: median (p99.9), at the largest |d|; errors in percent: max (p95), against "
            "full nonlinear solves of the pushes of each |d|, displacements as part of |d|, anywhere shown. Zones when they "
            "have come to rest; linear methods share their errors but where LCG stops early. The whole page, for a browser: "
            f"[{linked.removeprefix('../')}/index.html]({linked}/index.html).\n")
    for organ, title, by_strain in (("brain", "The brain, nu = 0.4, patches of 1.2 h", False),
                                    ("cylinder", "The paper's cylinder, pushed at one node", True)):
        path = folder / f"{organ}_methods.csv"
        if not path.exists():
            continue
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file))
        for contacts in sorted({int(row["contacts"]) for row in rows}):
            count = "one contact" if contacts == 1 else f"{contacts} contacts at once, at random places"
            text += f"\n{title}, {count}:\n\n{table(rows, contacts, by_strain)}\n"
            if any(row["method"].startswith("Bullet") and int(row["contacts"]) == contacts for row in rows):
                text += "\nBullet is asked the first few of these pushes; its law is its own, of the same moduli at small strain.\n"
            moving = moving_zones(rows, contacts, MOVING_PARTS)
            if moving and organ == "brain":
                text += ("\nIts zones as they move, by rings and Newton iterations a frame, after 50 frames from rest, at half and at all of its "
                         f"reach; those that say that they have not converged count:\n\n{moving}\n")
            picture = f"{organ}_{'speed_error' if contacts == 1 else 'several'}.svg"
            if organ == "brain":
                text += f"\n![speed against error, {count}]({linked}/plots/{picture})\n"
    (folder / "speed_error.md").write_text(text)


if __name__ == "__main__":
    main()
