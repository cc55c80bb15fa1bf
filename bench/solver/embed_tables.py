#!/usr/bin/python3
"""Puts what the studies printed into a page: what stands between the lines

    <!-- NAME.md -->
    <!-- end -->

is replaced by the file NAME.md of a folder, where there is one.

    bench/solver/embed_tables.py PAGE DIR
"""
import pathlib
import re
import sys


def main():
    page, folder = map(pathlib.Path, sys.argv[1:])
    text = page.read_text()
    names = re.findall(r"^<!-- (\w+\.md) -->$", text, re.M)
    names = [name for name in names if (folder / name).exists()]
    for name in names:
        table = (folder / name).read_text().strip()
        text = re.sub(rf"<!-- {re.escape(name)} -->\n.*?<!-- end -->",
                      lambda _: f"<!-- {name} -->\n{table}\n<!-- end -->", text, flags=re.S)
    page.write_text(text)
    print(f"{page}: {', '.join(names)}")


if __name__ == "__main__":
    main()
