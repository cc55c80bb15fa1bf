#!/usr/bin/python3
"""Puts the studies' tables into a page. The text between the lines

    <!-- NAME.md -->
    <!-- end -->

becomes the file DIR/NAME.md, if it exists.

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
