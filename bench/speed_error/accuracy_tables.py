#!/usr/bin/python3
"""Makes the tables of docs/accuracy.md from the CSVs of a report on the shipped organs.

    bench/speed_error/accuracy_tables.py DIR LINKED     writes DIR/speed_error.md

DIR: the output of `palpate report -o DIR`, with the output ORGAN_bullet.csv of palpate_study_bullet where Bullet is
installed; LINKED: the path of its stored copy, from docs/.
"""
import csv
import pathlib
import sys


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
    """'1.2 (3.4)': median and p99.9; empty where not measured"""
    median = row.get(stage + "_median_us")
    return f"{number(median)} ({number(row[stage + '_p999_us'])})" if median else ""


def rows_of(path):
    """The rows of a CSV; none without a file."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def name_of(rows):
    """The method of these rows, with its diverged pushes, if any."""
    diverged = sum(int(row.get("diverged", 0)) for row in rows)
    return rows[0]["method"] + (f", {diverged} of {sum(int(row['pushes']) for row in rows)} pushes diverged" if diverged else "")


def level_name(row, by_strain):
    if by_strain:
        return f"{float(row['size_over_thickness']) * 100:.0f} % strain"
    return f"{float(row['size_over_h']):.2g} h"


def table(rows, bullet, by_strain):
    """A line for each method of the report's rows and of Bullet's, all with as many contacts."""
    parts = sorted({float(row["part_of_max"]) for row in rows})
    level = {float(row["part_of_max"]): level_name(row, by_strain) for row in rows}
    heading = ["method", "forces, µs", "cold", "field, µs", "cold"]
    heading += [f"displacement error, {level[part]}" if part == parts[0] else level[part] for part in parts]
    heading += [f"force error, {level[part]}" if part == parts[0] else level[part] for part in parts]
    lines = ["| " + " | ".join(heading) + " |", "|---" + "|--:" * (len(heading) - 1) + "|"]
    for method in dict.fromkeys(row["method"] for row in rows + bullet):
        of_method = [row for row in rows + bullet if row["method"] == method]
        at = {float(row["part_of_max"]): row for row in of_method}
        last = at[max(at)]
        exact = method.startswith("full Newton")
        cells = [name_of(of_method), time(last, "haptic"), number(last.get("haptic_cold_median_us")), time(last, "visual"),
                 number(last.get("visual_cold_median_us"))]
        for error in ("displacement", "force"):
            cells += ["the truth" if exact else spread(at[part], error) if part in at else "" for part in parts]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main():
    folder, linked = pathlib.Path(sys.argv[1]), sys.argv[2]
    with (folder / "about.csv").open(newline="") as file:
        about = {row["what"]: row["value"] for row in csv.DictReader(file)}
    text = (f"{about['processor']}, one thread, {about['compiler'].split(',')[0]}, {about['date']}, version {about['version']}, "
            f"seed {about['seed']}. Frames in µs: median (p99.9), at the largest |d|; errors in percent: max (p95), against "
            "full nonlinear solves of the pushes of each |d|, displacements as part of |d|, anywhere shown. Zones when they "
            "have come to rest. Other linear methods share the errors of linear_dd; [PEERS.md](../bench/peers/PEERS.md) has "
            f"their times. The whole page, for a browser: [{linked.removeprefix('../')}/index.html]({linked}/index.html).\n")
    for organ, title, by_strain in (("brain", "The brain, nu = 0.4, patches of 1.2 h", False),
                                    ("cylinder", "The paper's cylinder, pushed at one node", True)):
        every_row = rows_of(folder / f"{organ}_methods.csv")
        every_bullet = rows_of(folder / f"{organ}_bullet.csv")
        for contacts in sorted({int(row["contacts"]) for row in every_row}):
            rows, bullet = ([row for row in some if int(row["contacts"]) == contacts] for some in (every_row, every_bullet))
            count = "one contact" if contacts == 1 else f"{contacts} contacts at once, at random places"
            text += f"\n{title}, {count}:\n\n{table(rows, bullet, by_strain)}\n"
            if bullet:
                text += "\nBullet is asked the first few of these pushes; its law is its own, of the same moduli at small strain.\n"
            picture = f"{organ}_{'speed_error' if contacts == 1 else 'several'}.svg"
            if organ == "brain":
                text += f"\n![speed against error, {count}]({linked}/plots/{picture})\n"
    (folder / "speed_error.md").write_text(text)


if __name__ == "__main__":
    main()
