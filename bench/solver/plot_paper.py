#!/usr/bin/python3
"""Draws the figures of palpate_study_paper.

    /usr/bin/python3 plot_paper.py DIR [OUT]     reads DIR/paper_*.csv, writes OUT/paper_*.svg (OUT: DIR if not given)

The same CSVs give the same bytes. Needs Debian's python3-matplotlib and python3-numpy.
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np

plt.rcParams.update({"svg.hashsalt": "palpate", "svg.fonttype": "none", "font.family": "sans-serif", "font.size": 9,
                     "axes.grid": True, "grid.color": "#e4e4e4", "axes.spines.top": False, "axes.spines.right": False,
                     "axes.titlesize": 10, "legend.frameon": False, "legend.fontsize": 8, "lines.linewidth": 1.6,
                     "figure.facecolor": "white", "path.simplify_threshold": 0.5})
LAWS = {"eq1": ("eq. (1)", "#0072b2", "-"), "eq11": ("eq. (11), κ = λ", "#d55e00", "-"),
        "eq11_matched": ("eq. (11), κ = λ + 2μ/3", "#d55e00", "--"), "linear": ("linear", "#777777", ":")}
HEIGHT = 20.0


def table(name):
    return np.genfromtxt(SOURCE / f"{name}.csv", delimiter=",", names=True, dtype=None, encoding="ascii")


def save(figure, name):
    figure.savefig(TARGET / f"{name}.svg", metadata={"Date": None})
    plt.close(figure)


def panels(count, height=3.1):
    return plt.subplots(1, count, figsize=(4.3 * count, height), layout="constrained")


def curves(axes, data, column, sign, laws=LAWS):
    """`column` against the force's size, for pushes (-1) or pulls (1)."""
    for law in laws:
        name, colour, style = LAWS[law]
        part = data[(data["law"] == law) & (sign * data["force"] > 0)]
        axes.plot(abs(part["force"]), part[column], style, color=colour, label=name)


def figure_3(data):
    figure, (push, pull) = panels(2)
    for axes, sign, title in ((push, -1, "(a) pushed"), (pull, 1, "(b) pulled")):
        curves(axes, data, "p1_z", sign)
        axes.axhline(sign * 0.18 * HEIGHT, color="#999999", linewidth=0.8)
        axes.text(80, sign * 0.18 * HEIGHT, "18 % of the height", ha="right", va="bottom", color="#666666", fontsize=8)
        axes.set(title=title, xlabel="force at P1", ylabel="displacement of P1, z")
    paper = table("paper_table2")
    push.plot(-paper["force"], paper["p1_z"], "o", color="#333333", markersize=3.5, label="the paper's tables 2, 3")
    push.legend()
    pull.legend()
    save(figure, "paper_figure3")


def figure_4(data):
    figure, axes = panels(2)
    for at, column, title, label in ((axes[0], "p2_y", "(a) P2", "displacement of P2, y"),
                                     (axes[1], "p3_x", "(b) P3", "displacement of P3, x")):
        curves(at, data, column, -1)
        at.set(title=title, xlabel="pushing force at P1", ylabel=label)
        at.legend()
    save(figure, "paper_figure4")


def figure_5(data):
    figure, (motion, energy) = panels(2)
    for law in ("eq1", "eq11"):
        name, colour, _ = LAWS[law]
        part = data[(data["law"] == law) & (data["force"] < 0)]
        for column, style, axis in (("p3_y", "--", "y"), ("p3_z", "-", "z")):
            motion.plot(part["p1_z"], part[column], style, color=colour, label=f"{axis}, {name}")
    motion.set(title="(a) pushed", xlabel="displacement of P1, z", ylabel="displacement of P3")
    motion.legend()
    data = table("paper_shear_energy")
    for law in ("eq1", "eq11"):
        energy.plot(data["J"], data[law], color=LAWS[law][1], label=LAWS[law][0].split(",")[0])
    energy.set(title="(b) shear energy at I = 4.2", xlabel="J", ylabel="energy per volume")
    energy.legend()
    save(figure, "paper_figure5")


def difference():
    data = np.sort(table("paper_difference"), order="force")
    figure, (soft, stiff) = panels(2)
    part = data[data["lambda_over_mu"] < 1]
    for column, colour, style, name in (("eq11", "#d55e00", "-", "κ = λ"),
                                        ("volume", "#009e73", "-.", "of it: volume term"),
                                        ("coupling", "#cc79a7", "-.", "of it: coupling"),
                                        ("eq11_matched", "#d55e00", "--", "κ = λ + 2μ/3")):
        soft.plot(part["force"], 100 * part[column], style, color=colour, label=name)
    for ratio, colour in zip(np.unique(data["lambda_over_mu"])[1:], ("#0072b2", "#333333")):
        part = data[data["lambda_over_mu"] == ratio]
        for column, style, name in (("eq11", "-", "κ = λ"), ("eq11_matched", "--", "κ = λ + 2μ/3")):
            stiff.plot(part["force"], 100 * part[column], style, color=colour, label=f"λ/μ = {ratio:g}, {name}")
    for axes, title in ((soft, "(a) λ/μ = 0.4167"), (stiff, "(b) λ/μ = 41.67 and 416.7")):
        axes.axhline(0, color="#999999", linewidth=0.8)
        axes.set(title=title, xlabel="force at P1 (below 0: pushed)", ylabel="tip, eq. (11) beyond eq. (1), %")
        axes.legend()
    save(figure, "paper_difference")


def penalty():
    data = np.sort(table("paper_penalty"), order="force")
    figure, axes = panels(1)
    for column, colour, style, name in (("eq1", "#0072b2", "-", "2 ln J"),
                                        ("penalty", "#d55e00", "-", "0.998 x 2 ln J"),
                                        ("penalty_from_its_rest", "#d55e00", ":", "0.998, from its own rest")):
        for sign, label in ((-1, name), (1, None)):  # the curve has a pole where the body is at rest
            part = data[sign * data["force"] > 0]
            axes.plot(part["force"], 100 * part[column], style, color=colour, label=label)
    axes.set(xlabel="force at P1 (below 0: pushed)", ylabel="tip, eq. (11) beyond it, %", xlim=(-30, 30),
             ylim=(-20, 60))
    axes.legend()
    save(figure, "paper_penalty")


if __name__ == "__main__":
    SOURCE = Path(sys.argv[1])
    TARGET = Path(sys.argv[2] if len(sys.argv) > 2 else sys.argv[1])
    TARGET.mkdir(parents=True, exist_ok=True)
    all_curves = table("paper_curves")
    figure_3(all_curves)
    figure_4(all_curves)
    figure_5(all_curves)
    difference()
    penalty()
