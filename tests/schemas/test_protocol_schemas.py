import json
from pathlib import Path

import jsonschema
import pytest
from ruamel.yaml import YAML

from workbench.cli.schema import schema_text
from workbench.schemas import SCHEMAS, load

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted(
    path
    for folder in ("protocols", "models", "workbench", "docs/examples", "examples/*")
    for path in ROOT.glob(f"{folder}/*.yaml")
)


@pytest.mark.parametrize("name", SCHEMAS)
def test_the_committed_schema_is_the_code_s(name: str) -> None:
    committed = ROOT / "docs" / "reference" / "schemas" / f"{name}-1.json"
    assert committed.read_text(encoding="utf-8") == schema_text(name), "run `make schemas`"


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
def test_every_file_of_the_project_obeys_its_schema_and_names_it(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    first = text.splitlines()[0]
    assert first.startswith("# yaml-language-server: $schema=")
    named = (path.parent / first.split("=", 1)[1]).resolve()
    content = json.loads(json.dumps(YAML(typ="safe").load(text), default=str))  # dates as text
    kind = content["schema"].removeprefix("workbench/").removesuffix("-1")
    assert named == ROOT / "docs" / "reference" / "schemas" / f"{kind}-1.json"
    jsonschema.validate(content, json.loads(named.read_text(encoding="utf-8")))
    load(path, SCHEMAS[kind])


def test_an_editor_would_mark_a_bare_number() -> None:
    schema = json.loads(schema_text("protocol"))
    step = {"run": {"mode": "hop", "speed": 17}}
    content = {"schema": "workbench/protocol-1", "title": "T", "steps": [step]}
    with pytest.raises(jsonschema.ValidationError, match="17 is not"):
        jsonschema.validate(content, schema)
