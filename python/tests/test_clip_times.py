"""Clips that are cut, joined, played faster, and that have some of their joints."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import unit

import tumble

NAMES = ["hip", "knee", "foot"]
OFFSETS = [[0, 0, 0], [0, -0.5, 0], [0, -0.4, 0.1]]


def clip(rng, frames=9, rate=30, *, first=0, names=NAMES, **others):
    keys = unit(rng, len(names), frames)
    root = rng.normal(size=(frames, 3))
    return tumble.Clip(
        (first + np.arange(frames)) / rate,
        keys,
        layout="track",
        names=list(names),
        parents=[None, 0, 1],
        offsets=OFFSETS,
        translations=[root, None, None],
        **others,
    )


def all_keys(clip, name):
    return clip.keys(name), clip.translations(name)


def test_parts_of_a_clip_have_its_bits_and_make_it_again(rng):
    whole = clip(rng, scalars={"grip": (np.arange(9) / 30, rng.normal(size=9))})
    parts = [whole.cut(end=4 / 30), whole.cut(4 / 30)]
    assert [part.span for part in parts] == [(0, 4 / 30), (4 / 30, 8 / 30)]
    for part, frames in zip(parts, [slice(0, 5), slice(4, 9)]):
        for name in NAMES:
            np.testing.assert_array_equal(part.keys(name), whole.keys(name)[frames])
            np.testing.assert_array_equal(part.times(name), whole.times(name)[frames])
        np.testing.assert_array_equal(part.translations("hip")[1], whole.translations("hip")[1][frames])
    assert tumble.Clip.concat(parts, gap=0.0) == whole
    assert tumble.Clip.concat([whole]) == whole
    between = whole.cut(0.05, 0.2)
    np.testing.assert_array_equal(between.times("hip")[1:-1], whole.times("hip")[2:6])
    np.testing.assert_array_equal(between.keys("hip")[1:-1], whole.keys("hip")[2:6])
    expected = whole.evaluate(at=[0.05])
    assert np.abs((expected[0, 0] * between.keys("hip")[0]).sum()) > 1 - 1e-6
    for wrong, error, words in [
        (dict(start=1.0, end=2.0), tumble.InputError, "nothing lies from 1 to 2 s"),
        (dict(start=True), TypeError, "start: True is no number"),
        (dict(end=np.timedelta64(1, "s")), TypeError, "end: .*timedelta64.* is no number"),
        (dict(start="0"), TypeError, "start: give seconds"),
    ]:
        with pytest.raises(error, match=words):
            whole.cut(**wrong)


def test_joined_clips_follow_one_another_frame_by_frame(rng):
    first, second = clip(rng), clip(rng, 5, first=60)
    joined = tumble.Clip.concat([first, second, first])
    np.testing.assert_array_equal(joined.times("foot"), np.arange(23) / 30)
    for name in NAMES:
        expected = np.concatenate([first.keys(name), second.keys(name), first.keys(name)])
        np.testing.assert_array_equal(joined.keys(name), expected)
    moves = [it.translations("hip")[1] for it in (first, second, first)]
    np.testing.assert_array_equal(joined.translations("hip")[1], np.concatenate(moves))
    assert joined.parents == first.parents
    later = tumble.Clip.concat([first, second], gap=0.5)
    np.testing.assert_allclose(later.times("hip")[9:], 8 / 30 + 0.5 + np.arange(5) / 30, atol=1e-15)
    # Joints have the order of the first clip.
    order = ["foot", "hip", "knee"]
    shuffled = tumble.Clip(
        second.times(0),
        np.stack([second.keys(name) for name in order]),
        layout="track",
        names=order,
        parents=[2, None, 1],
        offsets=[OFFSETS[2], OFFSETS[0], OFFSETS[1]],
        translations=[None, second.translations("hip")[1], None],
    )
    assert tumble.Clip.concat([first, shuffled]) == tumble.Clip.concat([first, second])


def test_what_is_constant_in_a_clip_stays_constant_in_the_joined_one(rng):
    still = tumble.Clip([np.arange(6) / 10, [0.0]], [unit(rng, 6), [[0, 0, 0, 1]]], names=["a", "b"], parents=[None, 0])
    moving = tumble.Clip(np.arange(6) / 10, unit(rng, 2, 6), layout="track", names=["a", "b"], parents=[None, 0])
    for clips in ([still, moving], [moving, still]):
        joined = tumble.Clip.concat(clips)
        at = 0.0 if clips[0] is still else 0.6
        for method in ("slerp", "bessel-overhauser"):
            held = joined.evaluate(at=at + np.linspace(0.0, 0.4, 9) + (0 if at == 0 else 0.1), method=method)[1]
            assert np.abs(held @ [0, 0, 0, 1]).min() > 1 - 1e-7, method
    both = tumble.Clip.concat([still, still])
    assert len(both.times("b")) == 1


def test_clips_that_do_not_fit_are_not_joined(rng):
    first = clip(rng)
    uneven = tumble.Clip([0.0, 0.1, 0.37], unit(rng, 3, 3), layout="track", names=NAMES, parents=[None, 0, 1], offsets=OFFSETS)
    for clips, options, words in [
        ([], {}, "clips: there are no clips"),
        ([first, clip(rng, names=["hip", "knee", "toe"])], {}, "clips: .*(foot|toe)"),
        ([first, uneven], {}, "gap: the clips have no common rate"),
        ([first, first], {"gap": 0.0}, "gap: the rotation of `hip` differs between the end of clip 0"),
        ([first, first], {"gap": -1.0}, "gap: -1 is no number of seconds"),
        ([first, clip(rng, scalars={"grip": ([0.0], [1.0])})], {}, "names or the order of their scalars"),
    ]:
        with pytest.raises(tumble.InputError, match=words):
            tumble.Clip.concat(clips, **options)
    with pytest.raises(TypeError, match="gap: True is no number"):
        tumble.Clip.concat([first, first], gap=True)
    other = tumble.Clip(first.times(0), unit(rng, 3, 9), layout="track", names=NAMES, parents=[None, 0, 1], offsets=np.ones((3, 3)))
    with pytest.raises(tumble.InputError, match="clip 1 and clip 0 differ in where `hip` rests"):
        tumble.Clip.concat([first, other])


def test_clips_are_played_faster_and_at_other_times(rng):
    whole = clip(rng, velocities=rng.normal(size=(3, 9, 3)))
    assert whole.retime() == whole
    fast = whole.retime(speed=2.0, start=1.0)
    np.testing.assert_array_equal(fast.times("knee"), 1.0 + np.arange(9) / 60)
    np.testing.assert_array_equal(fast.keys("knee"), whole.keys("knee"))
    times = np.linspace(0, 8 / 30, 33)
    for method in ("slerp", "hermite"):
        np.testing.assert_allclose(
            fast.evaluate(at=1.0 + times / 2, method=method), whole.evaluate(at=times, method=method), atol=3e-6
        )
    for wrong, error, words in [
        (dict(speed=0.0), tumble.InputError, "the speed 0 is not a number greater than 0"),
        (dict(speed=-1), tumble.InputError, "the speed -1"),
        (dict(speed=True), TypeError, "speed: True is no number"),
        (dict(start=float("inf")), tumble.InputError, "start: inf is not finite"),
    ]:
        with pytest.raises(error, match=words):
            whole.retime(**wrong)


def test_rates_of_files_stay_known(rng, tmp_path):
    tumble.save(tmp_path / "walk.npz", clip(rng), fps=30, method="slerp")
    walk = tumble.load(tmp_path / "walk.npz").clip
    assert walk.rate == 30
    assert tumble.Clip.concat([walk, walk]).rate == walk.cut(0.1, 0.2).rate == 30
    assert walk.retime(speed=2.0).rate == 60 and walk.retime(speed=0.5, start=1 / 45).rate == 15
    assert walk.cut(0.01, 0.2).rate is None
    assert [it.path for it in (walk.cut(0.1, 0.2), walk.select([0]))] == [walk.path] * 2


def test_some_joints_of_a_clip_are_selected_in_any_order(rng):
    whole = clip(rng)
    some = whole.select(["knee", "hip"])
    assert (some.names, some.parents) == (["knee", "hip"], [1, None])
    np.testing.assert_array_equal(some.keys("knee"), whole.keys("knee"))
    assert whole.select([1, 0]) == some
    with pytest.raises(tumble.InputError, match="`foot` is a child of `knee`, which is left out"):
        whole.select(["hip", "foot"])
