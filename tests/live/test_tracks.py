from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from bimvox.errors import FileError
from bimvox.live.deciders import stop_and_wait
from bimvox.live.env import example_job
from bimvox.live.episode import WAIT, Episode, Stage
from bimvox.live.tracks import read_tracks, with_tracks
from bimvox.live.traffic import CREW_RADIUS_M, LORRY_RADIUS_M, RADIUS, Density

HEAD = "id,kind,time_s,x_m,y_m\n"
GOOD = HEAD + "anna,person,0,10,-10\nvan,vehicle,5,30,30\nanna,person,20,30,-10\nvan,vehicle,25,30,10\n"


def episode_of(folder: Path, text: str, name: str = "tracks.csv") -> Episode:
    path = folder / name
    path.write_text(text)
    job = example_job()
    job = dataclasses.replace(job, ground=with_tracks(job.ground, read_tracks(path)))
    return Episode(job, Density(0, 0), 0)


def test_tracks_are_followed_at_their_times_and_end_where_they_end(tmp_path):
    episode = episode_of(tmp_path, GOOD)
    np.testing.assert_array_equal(episode.crowd.state[:, :2], [[10, -10], [30, 30]])
    np.testing.assert_array_equal(episode.crowd.state[:, RADIUS], [CREW_RADIUS_M, LORRY_RADIUS_M])
    episode.decide(WAIT)
    np.testing.assert_allclose(episode.crowd.state[:, :2], [[20, -10], [30, 25]])
    episode.decide(WAIT)
    episode.decide(WAIT)
    np.testing.assert_allclose(episode.crowd.state[:, :2], [[30, -10], [30, 10]])


def test_a_job_is_carried_out_among_tracks(tmp_path):
    episode = episode_of(tmp_path, GOOD + "anna,person,900,40,-40\nvan,vehicle,950,60,30\n")
    while episode.stage is not Stage.OVER:
        episode.decide(stop_and_wait(episode))
    assert not episode.is_cut
    assert episode.violations == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("id,kind,time_s,x_m\n", "line 1: column y_m is missing"),
        (HEAD, "holds no track"),
        (HEAD + "a,dog,0,0,0\n", "line 2: kind 'dog' is not known"),
        (HEAD + ",person,0,0,0\n", "line 2: id is missing"),
        (HEAD + "a,person,0,north,0\n", "line 2: x_m 'north' is not a number"),
        (HEAD + "a,person,0,0\n", "line 2: y_m None is not a number"),
        (HEAD + "a,person,nan,0,0\n", "line 2: time_s is nan"),
        (HEAD + "a,person,5,0,0\na,person,5,1,0\n", "line 3: time_s 5 of a is not after 5"),
        (HEAD + "a,person,0,0,0\na,vehicle,5,1,0\n", "line 3: a is a person above and a vehicle here"),
        (HEAD + "a,person,0,0,0\na,person,10,30,0\n", "line 3: a moves at 3.00 m/s; the shield assumes 1.5 m/s"),
    ],
)
def test_a_bad_file_is_refused_by_line(tmp_path, text, message):
    with pytest.raises(FileError, match=message.replace("(", r"\(")) as refused:
        episode_of(tmp_path, text)
    assert str(tmp_path / "tracks.csv") in str(refused.value)


def test_what_is_no_text_is_refused(tmp_path):
    path = tmp_path / "tracks.csv"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileError, match="is not a CSV file in UTF-8"):
        read_tracks(path)


def in_json(*tracks: object) -> str:
    return json.dumps({"tracks": tracks})


ANNA = {"id": "anna", "kind": "person", "samples": [[0, 10, -10], [20.0, 30, -10]]}


def test_a_json_file_gives_the_same_tracks(tmp_path):
    van = {"id": "van", "kind": "vehicle", "samples": [[5, 30, 30], [25, 30, 10]]}
    one, other = episode_of(tmp_path, GOOD), episode_of(tmp_path, in_json(ANNA, van), "tracks.json")
    for mine, theirs in zip(one.job.ground, other.job.ground, strict=True):
        np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "is not a JSON file in UTF-8: not JSON: "),
        ("[]", "tracks: is missing or not a list"),
        (in_json(), "holds no track"),
        (in_json(7), r"tracks\[0\].samples: is missing, empty or not a list"),
        (in_json({**ANNA, "samples": []}), r"tracks\[0\].samples: is missing, empty"),
        (in_json({**ANNA, "samples": [[0, 1]]}), r"tracks\[0\].samples\[0\]: is not \[time_s, x_m, y_m\]"),
        (in_json({**ANNA, "samples": [[0, 1, True]]}), r"tracks\[0\].samples\[0\]: y_m True is not a number"),
        (in_json({**ANNA, "samples": [[0, None, 1]]}), r"tracks\[0\].samples\[0\]: x_m None is not a number"),
        (in_json({**ANNA, "id": 3}), r"tracks\[0\].samples\[0\]: id is missing"),
        (in_json({**ANNA, "kind": ["person"]}), r"tracks\[0\].samples\[0\]: kind \['person'\] is not known"),
        (in_json(ANNA, ANNA), r"tracks\[1\].id: 'anna' is there twice"),
        (in_json({**ANNA, "samples": [[0, 0, 0], [1, 9, 0]]}), r"tracks\[0\].samples\[1\]: anna moves at 9.00 m/s"),
    ],
)
def test_a_bad_json_file_is_refused_by_key(tmp_path, text, message):
    with pytest.raises(FileError, match=message):
        episode_of(tmp_path, text, "tracks.json")
