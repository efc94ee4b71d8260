"""Golden bytes of a rewrite: what the commands write and print before it, compared after each step.

    python -m tests.golden make tests/golden/golden.tar.xz
    python -m tests.golden compare tests/golden/golden.tar.xz /tmp/now.tar.xz

`make` does the runs of `runs.py` with the code that is imported, on bundled data, by the words that
people type, and keeps every file and every printed text: the runs' folders with their journals,
replies, scores and results, tables, comparisons, the page with its data, and all exports. FOLDER is
a folder or an archive, as its name ends. With names of cases behind it, only these are run. It
takes one core about four minutes. One `make` at a time on a machine: the served model has a port.

What cannot be equal twice is replaced, by the rules of `normal.py` alone. An identity of a run is
kept in `identities.json` and has a placeholder everywhere else, so that a changed one is seen once.
Pictures are kept as digests. Both are to be made on one machine with the same libraries: another
processor rounds otherwise.

`compare` prints each difference in a line, `FILE: KEYS: OLD -> NEW`, their number, and ends with 1
if one of them has no name. Names stand in `tests/golden/named.txt`, if it is there: a regular
expression that is searched in such lines, two spaces, `#`, and why they differ, as the change log
says it.
"""
