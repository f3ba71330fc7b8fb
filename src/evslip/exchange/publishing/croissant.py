"""Croissant metadata (https://docs.mlcommons.org/croissant/docs/croissant-spec.html, version 1.0) as JSON-LD."""

import json
from typing import Any

from evslip.exchange.publishing.table import COLUMNS

METADATA = "croissant.json"
"""Name of its file in a publication."""
_WORDS = """
citeAs column conformsTo cr data dataType dct extract field fileObject fileProperty fileSet format includes
isLiveDataset jsonPath key md5 parentField path recordSet references regex repeated replace sc separator source
subField transform equivalentProperty examples rai samplingRate
"""
CONTEXT: dict[str, Any] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    **{word: f"cr:{word}" for word in _WORDS.split()},
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "sc": "https://schema.org/",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "rai": "http://mlcommons.org/croissant/RAI/",
}
"""Context in the words of the specification."""


def croissant(
    name: str,
    description: str,
    license_url: str,
    tables: dict[str, str],
    data: list[tuple[str, str, str]],
    more: dict[str, str],
) -> str:
    """The metadata. tables: sha256 of each split's table; data: name, media type and pattern of each set of files;
    more: other properties of the data set that are known."""
    distribution = [
        _named("cr:FileObject", f"{split}.jsonl", f"Table of the split {split}, a sample a line.")
        | {"contentUrl": f"{split}.jsonl", "encodingFormat": "application/jsonlines", "sha256": digest}
        for split, digest in tables.items()
    ]
    distribution += [
        _named("cr:FileSet", identifier, "Records in HDF5 files, or shards of them.")
        | {"encodingFormat": media_type, "includes": pattern}
        for identifier, media_type, pattern in data
    ]
    records = [
        _named("cr:RecordSet", split, f"Samples of the split {split}.") | {"field": _fields(split)} for split in tables
    ]
    whole = {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "name": name,
        "description": description,
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "license": license_url,
        "version": "1.0.0",
        **more,
        "distribution": distribution,
        "recordSet": records,
    }
    return json.dumps(whole, indent=2, ensure_ascii=False) + "\n"


def _fields(split: str) -> list[dict[str, Any]]:
    return [
        _named("cr:Field", f"{split}/{column}", meaning[0].upper() + meaning[1:] + ".")
        | {"dataType": kind, "source": {"fileObject": {"@id": f"{split}.jsonl"}, "extract": {"column": column}}}
        for column, (kind, meaning) in COLUMNS.items()
    ]


def _named(kind: str, name: str, description: str) -> dict[str, Any]:
    return {"@type": kind, "@id": name, "name": name, "description": description}
