"""How organbench is cited: CITATION.cff, https://citation-file-format.github.io."""

import json

AUTHORS = "organbench developers"
LICENSE = "BSD-3-Clause"
TITLE = "organbench"
ABSTRACT = (
    "How accurate, how fast and how stable are volume-preserving mass-spring organs, measured against finite elements."
)
PAPER = {
    "type": "article",
    "title": "Fast volume preservation for a mass-spring system",
    "authors": [{"family-names": name} for name in ("Hong", "Jung", "Choi", "Welch")],
    "journal": "IEEE Computer Graphics and Applications",
    "volume": 26,
    "issue": 5,
    "year": 2006,
}


def citation(version: str) -> str:
    """The file for a version, in YAML."""
    entries = {
        "cff-version": "1.2.0",
        "message": "If you use organbench or its results, please cite it as below, and the method that it measures.",
        "type": "software",
        "title": TITLE,
        "abstract": ABSTRACT,
        "version": version,
        "license": LICENSE,
        "authors": [{"name": AUTHORS}],
        "references": [PAPER],
    }
    # JSON is YAML: quoting is left to a library.
    return "".join(f"{name}: {json.dumps(value, ensure_ascii=False)}\n" for name, value in entries.items())
