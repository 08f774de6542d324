"""The JSON schema of scene files, for editors and other programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from xpheve.scene.model import LawTable, SceneTable

if TYPE_CHECKING:
    from xpheve.plugins.registry import LawInfo, Registry

ADDRESS = "https://json-schema.org/draft/2020-12/schema"


def schema(registry: Registry | None = None) -> dict[str, Any]:
    """Return the JSON schema of scene files, with the parameters of all laws at hand, read from manifests."""
    from xpheve.plugins.registry import Registry
    from xpheve.plugins.spec import json_schema_of
    from xpheve.scene.wakeups import CONDITIONS

    def law(info: LawInfo) -> dict[str, Any]:
        own = {param.name: json_schema_of(param) for param in info.spec.params}
        for param in info.spec.params:
            if _is_writable(param.default):
                own[param.name]["default"] = list(param.default) if isinstance(param.default, tuple) else param.default
        return {
            "title": info.id,
            "description": info.doc,
            "properties": {**common, "id": {"const": info.id}, **own},
            "required": ["id"],
            "additionalProperties": False,
        }

    found: dict[str, Any] = SceneTable.model_json_schema()
    found["$schema"] = ADDRESS
    found["title"] = "xPheve scene"
    definitions = found["$defs"]
    common = {
        key: value for key, value in definitions["LawTable"]["properties"].items() if key in LawTable.model_fields
    }
    definitions["ConditionTable"]["properties"]["kind"] = {"enum": list(CONDITIONS)}
    laws = (registry if registry is not None else Registry.default()).laws()
    if laws:
        definitions["LawTable"] = {
            "title": "A law and its parameters",
            "type": "object",
            "oneOf": [law(one) for one in laws],
        }
    _forget_defaults_of_none(found)
    return found


def _is_writable(value: Any) -> bool:
    values = value if isinstance(value, tuple) else (value,)
    return all(
        isinstance(one, (bool, int, str)) or (isinstance(one, float) and abs(one) < float("inf")) for one in values
    )


def _forget_defaults_of_none(value: Any) -> None:
    """TOML has no null: a key that may be left out says so by not being required, and needs no default of null."""
    if isinstance(value, dict):
        if "default" in value and value["default"] is None:
            del value["default"]
        if "anyOf" in value and {"type": "null"} in value["anyOf"]:
            value["anyOf"] = [one for one in value["anyOf"] if one != {"type": "null"}]
            if len(value["anyOf"]) == 1:
                value.update(value.pop("anyOf")[0])
        for one in value.values():
            _forget_defaults_of_none(one)
    elif isinstance(value, list):
        for one in value:
            _forget_defaults_of_none(one)
