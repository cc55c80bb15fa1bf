#!/usr/bin/python3
"""The table of `./dev report` from palpate_bench_kernels: each kernel beside a memcpy of the bytes that it reads.

The memcpy is the bound that memory sets.

    build/release/bin/palpate_bench_kernels --benchmark_format=json > KERNELS.json
    bench/micro_table.py KERNELS.json OUT.csv     writes OUT.csv, and OUT.txt for reading
"""
import csv
import json
import pathlib
import statistics
import sys

# The copy of a kernel's bytes, by the start of the kernel's name.
COPIES = {"field": "copy_of_same_bytes", "rounded_field": "copy_of_same_rounded_bytes",
          "held_inverse": "copy_of_contact_stiffness", "zone_product": "copy_of_zone_product"}


def shape_of(name):
    """'field_avx512/rows:960/columns:3' -> 'field_avx512', 'rows 960, columns 3'"""
    kernel, *shape = name.split("/")
    return kernel, ", ".join(part.replace(":", " ") for part in shape)


def copy_name(kernel):
    for start in sorted(COPIES, key=len, reverse=True):
        if kernel.startswith(start):
            return COPIES[start]
    return None


def main():
    source, out = map(pathlib.Path, sys.argv[1:])
    report = json.loads(source.read_text())
    runs = {}  # (kernel, shape) -> ns of its repetitions, bytes of a call, multiply-adds a second
    for run in report["benchmarks"]:
        if run.get("run_type") != "iteration":
            continue
        if run["time_unit"] != "ns":
            sys.exit(f"{source}: {run['name']} is not in nanoseconds")
        times = runs.get(shape_of(run["run_name"]), ([],))[0]
        times.append(run["cpu_time"])
        size = round(run.get("bytes_per_second", 0) * run["cpu_time"] * 1e-9)
        runs[shape_of(run["run_name"])] = (times, size, run.get("multiply_adds", 0))
    with out.open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["kernel", "shape", "reads, KB", "a call, µs", "GB/s", "multiply-adds, G/s", "memcpy of as much, µs", "memcpy, GB/s",
                        "of the memcpy's bandwidth, %"])
        for (kernel, shape), (times, size, work) in runs.items():
            if kernel.startswith("copy_of"):
                continue
            time = statistics.median(times)
            row = [kernel, shape, "", f"{time / 1000:.3g}", "", f"{1e-9 * work:.2f}" if work else "", "", "", ""]
            copied = runs.get((copy_name(kernel), shape))
            if size:
                row[2] = f"{size / 1024:.1f}"
                row[4] = f"{size / time:.1f}"
            if copied:
                copy = statistics.median(copied[0])
                row[6:] = [f"{copy / 1000:.3g}", f"{size / copy:.1f}", f"{100 * copy / time:.0f}"]
            table.writerow(row)
    caches = ", ".join(f"L{cache['level']} {cache['type'].lower()} {cache['size'] // 1024} KB"
                       for cache in report["context"].get("caches", []))
    out.with_suffix(".txt").write_text(
        "Each kernel that this processor runs, by Google Benchmark: bytes that a call reads, processor time of a call, and a "
        "memcpy of as many bytes, which also writes them: a kernel that only reads may pass it. Caches: " + caches + ".\n")


if __name__ == "__main__":
    main()
