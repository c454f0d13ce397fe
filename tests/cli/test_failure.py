import json

import pytest
from bimvox_cli.failure import exit_code_of, report, report_runs

from bimvox.errors import ConfigError, GridTooLargeError, InputError, NoPlanError, PolicyError, VerificationError

_FAILED = {
    ("config",): 2,
    ("no-plan",): 1,
    ("no-order", "file"): 2,
    ("verification", "motion", "planning"): 1,
    ("died",): 1,
    ("file", "fault"): 70,
}
"""Codes of the errors of runs, and the exit code of all of them."""


def _runs(*codes: str) -> list[dict[str, object]]:
    good = {"run": "good", "error": None}
    return [good, *({"run": code, "error": {"code": code, "message": f"{code}!"}} for code in codes)]


@pytest.mark.parametrize(
    ("document", "code"),
    [
        ({}, 0),
        ({"verified": True, "infeasible": []}, 0),
        ({"verified": False}, 1),
        ({"verified": True, "infeasible": [{"component": "b"}]}, 1),
        *(({"verified": False, "failed": len(codes), "runs": _runs(*codes)}, code) for codes, code in _FAILED.items()),
        ({"verified": True, "failed": 1, "sites": [{"name": "a", "error": "ifc: no", "error_code": "ifc"}]}, 2),
    ],
)
def test_exit_code_of_a_finished_command(document: dict[str, object], code: int) -> None:
    assert exit_code_of(document) == code


def test_message_and_hint_go_to_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    error = ConfigError(
        "a.toml", "crane.jib", "unknown key", available=["jib_length_m"], hint="did you mean jib_length_m?"
    )
    assert report(error, as_json=False) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err == "error: a.toml: crane.jib: unknown key\n  hint: did you mean jib_length_m?\n"


def test_json_carries_the_evidence(capsys: pytest.CaptureFixture[str]) -> None:
    error = ConfigError("a.toml", "crane.jib", "unknown key", available=["jib_length_m"], hint="see schema")
    report(error, as_json=True)
    assert json.loads(capsys.readouterr().out) == {
        "error": {
            "code": "config",
            "message": "a.toml: crane.jib: unknown key",
            "hint": "see schema",
            "path": "a.toml",
            "key": "crane.jib",
            "available": ["jib_length_m"],
            "exit_code": 2,
        }
    }


@pytest.mark.parametrize(
    ("error", "code", "evidence"),
    [
        (NoPlanError("no lift", reasons={"b": "enclosed"}), 1, {"reasons": {"b": "enclosed"}}),
        (VerificationError("a proof failed", failures=["swept"]), 1, {"failures": ["swept"]}),
        (GridTooLargeError(10, 5, 0.1, 0.2), 2, {"cells": 10, "limit": 5, "fitting_voxel_size_m": 0.2}),
        (PolicyError("unfit", differs={"window": (7, 7, 5)}), 2, {"differs": {"window": [7, 7, 5]}}),
    ],
)
def test_each_kind_of_error_has_its_code(
    error: Exception, code: int, evidence: dict[str, object], capsys: pytest.CaptureFixture[str]
) -> None:
    assert report(error, as_json=True) == code
    document = json.loads(capsys.readouterr().out)["error"]
    assert document["exit_code"] == code
    assert evidence.items() <= document.items()


def test_a_rejected_event_is_bad_input_whatever_the_current_plan():
    assert exit_code_of({"event": "rejected", "infeasible": ["a"]}) == 2
    assert exit_code_of({"event": "unchanged", "infeasible": ["a"]}) == 1


def test_json_evidence_holds_no_private_attributes(capsys):
    error = InputError("wrong")
    error._inside = object()
    assert report(error, as_json=True) == 2
    assert "_inside" not in capsys.readouterr().out


def test_a_message_of_any_length_is_cut(capsys: pytest.CaptureFixture[str]) -> None:
    assert report(InputError("a" * 1_000_000, hint="b" * 1_000_000), as_json=False) == 2
    err = capsys.readouterr().err
    assert len(err) < 8100
    assert "a..." in err
    assert err.endswith("b...\n")


def test_a_number_of_threads_that_numba_refuses_is_bad_input(monkeypatch, capsys):
    monkeypatch.setenv("NUMBA_NUM_THREADS", "0")
    assert report(ValueError("Number of threads specified must be > 0."), as_json=False) == 2
    assert "NUMBA_NUM_THREADS is '0'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("MPLBACKEND", "Key backend: 'x' is not a valid value for backend; supported values are ['agg']"),
        ("SOURCE_DATE_EPOCH", "invalid literal for int() with base 10: 'x'"),
    ],
)
def test_an_environment_variable_that_a_library_refuses_is_bad_input(name, said, monkeypatch, capsys):
    assert report(ValueError(said), as_json=False) == 70
    monkeypatch.setenv(name, "x")
    assert report(ValueError(said), as_json=False) == 2
    assert f"{name} is 'x'" in capsys.readouterr().err


def test_runs_that_failed_are_told_on_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    report_runs({"verified": True, "runs": _runs()})
    assert capsys.readouterr().err == ""
    report_runs({"failed": 2, "runs": _runs("config", "no-plan")})
    assert capsys.readouterr().err == "error: 2 of 3 failed; config: config!\n"
