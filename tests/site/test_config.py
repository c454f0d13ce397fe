import json
from dataclasses import asdict

from bimvox.site.config import ModelConfig, RulesConfig, SiteConfig, site_json_schema
from bimvox.site.site import Rules
from bimvox.units import METRES_PER_UNIT


def test_the_rules_have_the_planners_names_and_defaults():
    assert RulesConfig().model_dump() == asdict(Rules())
    assert RulesConfig(rope=False).rules() == Rules(rope=False)


def test_the_units_are_the_known_ones():
    schema = ModelConfig.model_json_schema()["properties"]["unit"]
    assert set(schema["anyOf"][0]["enum"]) == set(METRES_PER_UNIT)


def test_the_schema_names_every_key_and_describes_it():
    schema = json.loads(json.dumps(site_json_schema()))
    assert schema["properties"].keys() == SiteConfig.model_fields.keys()
    assert schema["additionalProperties"] is False
    for name in ("ModelConfig", "CraneConfig", "ComponentConfig", "RulesConfig", "PolicyConfig"):
        for key, value in schema["$defs"][name]["properties"].items():
            assert "description" in value, f"{name}.{key}"
