"""Croissant metadata (https://docs.mlcommons.org/croissant/docs/croissant-spec.html, version 1.0) as JSON-LD."""

import json
from typing import Any

from evslip.exchange.publishing.table import COLUMNS

CONTEXT = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "rai": "http://mlcommons.org/croissant/RAI/",
    "samplingRate": "cr:samplingRate",
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
    distribution: list[dict[str, Any]] = [
        {
            "@type": "cr:FileObject",
            "@id": f"{split}.jsonl",
            "name": f"{split}.jsonl",
            "description": f"Table of the split {split}, a sample a line.",
            "contentUrl": f"{split}.jsonl",
            "encodingFormat": "application/jsonlines",
            "sha256": digest,
        }
        for split, digest in tables.items()
    ]
    distribution += [
        {
            "@type": "cr:FileSet",
            "@id": identifier,
            "name": identifier,
            "description": "Records in HDF5 files, or shards of them.",
            "encodingFormat": media_type,
            "includes": pattern,
        }
        for identifier, media_type, pattern in data
    ]
    records = [
        {
            "@type": "cr:RecordSet",
            "@id": split,
            "name": split,
            "description": f"Samples of the split {split}.",
            "field": [
                {
                    "@type": "cr:Field",
                    "@id": f"{split}/{column}",
                    "name": f"{split}/{column}",
                    "description": meaning[0].upper() + meaning[1:] + ".",
                    "dataType": kind,
                    "source": {"fileObject": {"@id": f"{split}.jsonl"}, "extract": {"column": column}},
                }
                for column, (kind, meaning) in COLUMNS.items()
            ],
        }
        for split in tables
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
