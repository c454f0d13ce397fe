from __future__ import annotations

import io

import numpy as np
import pytest
from log_building import tiny_log
from PIL import Image

from bimvox.errors import InputError
from bimvox.log.moving import tracks_of
from bimvox.records.motion import PhaseName
from bimvox.rendering.colours import ARRIVED, ASSEMBLED, IN_TRANSIT, PAPER, UNBUILT
from bimvox.rendering.pictures.camera import Camera
from bimvox.rendering.pictures.film import STANDING, FilmOptions, default_seconds, frame_times_ns, write_film
from bimvox.rendering.pictures.film_scene import Film, rotation
from bimvox.rendering.pictures.picture import PictureOptions
from bimvox.rendering.pictures.scene import Scene
from bimvox.site.component import StoredPose

SMALL = FilmOptions(size_px=(96, 72), samples=1, fps=10)


def tiny_film(*, crane: bool = True) -> Film:
    log = tiny_log(crane=crane)
    return Film(log.plan.site, log.all_lifts, log.motions, tracks_of(log))


def colours_of(film: Film, time_ns: int) -> dict[tuple[int, ...], int]:
    """Return the number of cells of each colour."""
    scene = film.scene(time_ns)
    numbers, counts = np.unique(scene.solids[scene.solids > 0], return_counts=True)
    found: dict[tuple[int, ...], int] = {}
    for number, count in zip(numbers, counts, strict=True):
        rgb = tuple(int(n) for n in scene.palette[number])
        found[rgb] = found.get(rgb, 0) + int(count)
    return found


def written(film: Film, times_ns: list[int], options: FilmOptions, file_format: str) -> bytes:
    stream = io.BytesIO()
    write_film(stream, film, times_ns, options, file_format)
    return stream.getvalue()


@pytest.mark.parametrize("crane", [True, False])
def test_a_part_goes_through_the_papers_states(crane: bool):
    film = tiny_film(crane=crane)
    track = film.tracks[0]
    cells = len(film.site.components[track.lift.component].shape.cells)
    middle = (track.lifted_ns + track.arrived_ns) // 2
    if crane:
        assert colours_of(film, track.start_ns)[UNBUILT] >= cells
    assert colours_of(film, middle).get(IN_TRANSIT) == cells
    assert colours_of(film, (track.arrived_ns + track.assembled_ns) // 2)[ARRIVED] == cells
    assert colours_of(film, track.assembled_ns)[ASSEMBLED] == cells


def test_the_load_is_where_the_log_has_it():
    film = tiny_film()
    site = film.site
    for track in film.tracks:
        part = site.components[track.lift.component]
        upright = np.flatnonzero(np.abs(track.tilt[:, 3]) > 0.9999)
        for n in upright[:: max(1, len(upright) // 7)]:
            time_ns = int(track.time_ns[n])
            if not track.lifted_ns <= time_ns < track.assembled_ns:
                continue
            scene = film.scene(time_ns)
            drawn = np.argwhere(np.isin(scene.solids, [len(scene.palette) - 1]))
            low_m = site.frame.corner_of(drawn.min(axis=0))
            assert np.abs(low_m - track.corner_m[n]).max() <= 0.5 * site.frame.voxel_size_m + 1e-9
            assert len(drawn) == len(part.shape.cells)


def test_a_part_that_is_tipped_up_is_turned_as_the_log_says():
    film = tiny_film()
    track = film.tracks[0]
    assert track.lift.place.pose is StoredPose.LYING_X
    tipping = np.flatnonzero((np.abs(track.tilt[:, 3]) < 0.98) & (track.time_ns >= track.lifted_ns))
    n = int(tipping[len(tipping) // 2])
    scene = film.scene(int(track.time_ns[n]))
    assert not (scene.palette == IN_TRANSIT).all(axis=1)[np.unique(scene.solids)].any()
    boxes = [block for block in scene.blocks if block.rgb == IN_TRANSIT]
    part = film.site.components[track.lift.component]
    assert len(boxes) == len(part.shape.boxes)
    volume = sum(8.0 * abs(np.linalg.det(block.half_m)) for block in boxes)
    assert volume == pytest.approx(len(part.shape.cells) * film.site.frame.voxel_size_m**3)
    # The lowest corner of the part is where the log has it.
    turned = rotation(track.tilt[n])
    np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-12)
    size = (part.shape.boxes[0, :3] + part.shape.boxes[0, 3:]) / 2.0 * film.site.frame.voxel_size_m
    np.testing.assert_allclose(boxes[0].centre_m, track.corner_m[n] + turned @ size, atol=1e-9)


def test_the_caption_has_clock_lift_and_phase():
    film = tiny_film()
    track = film.tracks[1]
    words = film.scene((track.lifted_ns + track.arrived_ns) // 2).caption
    assert words.startswith("0:")
    assert f"lift {track.lift.order + 1} of 3" in words


def test_motion_is_shown_at_length_and_standing_quickly():
    film = tiny_film()
    motions = list(film.motions.values())
    times = frame_times_ns(film.tracks, motions, 400)
    assert times == sorted(times)
    assert (times[0], times[-1]) == (film.start_ns, film.end_ns)
    spans: dict[bool, list[float]] = {True: [0, 0.0], False: [0, 0.0]}
    for motion in motions:
        for phase in motion.phases:
            still = phase.name in (PhaseName.HOOK_ON, PhaseName.SET, PhaseName.RELEASE)
            spans[still][0] += sum(phase.start_ns <= time < phase.end_ns for time in times)
            spans[still][1] += phase.end_ns - phase.start_ns
    moving, standing = (spans[still][0] / spans[still][1] for still in (False, True))
    assert moving / standing == pytest.approx(STANDING, rel=0.35)


def test_only_the_requested_lifts_have_frames():
    film = tiny_film()
    track = film.tracks[1]
    times = frame_times_ns((track,), list(film.motions.values()), 10)
    assert (times[0], times[-1]) == (track.start_ns, track.end_ns)
    even = tiny_film(crane=False)
    times = frame_times_ns(even.tracks, (), 11)
    assert np.ptp(np.diff(times)) <= 1


@pytest.mark.parametrize("file_format", ["gif", "webp"])
def test_an_animation_has_its_frames_and_its_size_and_equal_bytes(file_format: str):
    film = tiny_film()
    times = frame_times_ns(film.tracks, list(film.motions.values()), 9)
    data = written(film, times, SMALL, file_format)
    assert data == written(tiny_film(), times, SMALL, file_format)
    image = Image.open(io.BytesIO(data))
    assert image.format == file_format.upper()
    assert image.size == (96, 72)
    assert image.n_frames == 9
    frames = []
    for n in range(9):
        image.seek(n)
        image.load()
        frames.append(np.asarray(image.convert("RGB")).astype(int))
        assert image.info["duration"] == (100 if n < 8 else 1600)
    assert np.abs(frames[0] - frames[-1]).mean() > 0.5
    # The background has one colour in every frame.
    assert len({tuple(frame[2, -3]) for frame in frames}) == 1


def test_a_gif_shows_what_the_frames_are():
    """Pixels that are left transparent because they did not change must add up to the true frame."""
    film = tiny_film()
    times = frame_times_ns(film.tracks, list(film.motions.values()), 6)
    gif, webp = (Image.open(io.BytesIO(written(film, times, SMALL, kind))) for kind in ("gif", "webp"))
    for n in range(6):
        gif.seek(n)
        webp.seek(n)
        one, other = (np.asarray(image.convert("RGB")).astype(int) for image in (gif, webp))
        assert np.abs(one - other).mean() < 4.0


def test_the_camera_stands_still_and_holds_everything(monkeypatch: pytest.MonkeyPatch):
    film = tiny_film()
    times = frame_times_ns(film.tracks, list(film.motions.values()), 12)
    cameras = []

    def shown(scene: Scene, options: PictureOptions, camera: Camera) -> np.ndarray:
        cameras.append(camera)
        assert (camera.project(scene.points_m)[:, :2] >= 0.0).all()
        assert (camera.project(scene.points_m)[:, :2] <= options.size_px).all()
        return np.zeros((options.size_px[1], options.size_px[0], 3), np.uint8)

    monkeypatch.setattr("bimvox.rendering.pictures.film.picture_of", shown)
    written(film, times, SMALL, "webp")
    assert len(cameras) == 12
    assert len({(tuple(camera.eye_m), camera.focal_px, camera.centre_px) for camera in cameras}) == 1


def test_an_animation_that_is_interrupted_says_so():
    film = tiny_film()
    times = frame_times_ns(film.tracks, list(film.motions.values()), 6)

    def stop(_stage: str, done: int, _total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_film(io.BytesIO(), film, times, SMALL, "gif", stop)


def test_what_cannot_be_animated_is_reported():
    film = tiny_film()
    for frames in (1, 100_000):
        with pytest.raises(InputError, match="frames"):
            frame_times_ns(film.tracks, (), frames)
    with pytest.raises(InputError, match="time"):
        Film(film.site, film.lifts, (), ())
    with pytest.raises(InputError, match="frames a second"):
        FilmOptions(fps=200.0)
    with pytest.raises(InputError, match="no path to show"):
        film.track_of(1)
    assert [default_seconds(n) for n in (1, 2, 60, 1000)] == [8.0, 6.0, 12.0, 24.0]


def test_a_gif_has_the_papers_colours_exactly():
    film = tiny_film()
    times = frame_times_ns(film.tracks, list(film.motions.values()), 4)
    image = Image.open(io.BytesIO(written(film, times, FilmOptions(size_px=(320, 240), samples=1), "gif")))
    pixels = {tuple(int(n) for n in rgb) for rgb in np.unique(np.asarray(image.convert("RGB")).reshape(-1, 3), axis=0)}
    assert {UNBUILT, IN_TRANSIT, ARRIVED, ASSEMBLED, PAPER} <= pixels
