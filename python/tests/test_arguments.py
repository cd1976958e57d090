"""Odd and wrong arguments, each with its verdict: a result, or an exception that says why."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from conftest import unit

import tumble

RNG = np.random.default_rng(7)
TIMES = np.array([0.0, 0.5, 1.25, 2.0])
KEYS = unit(RNG, 3, 4)
EXPECTED = tumble.evaluate(TIMES, KEYS, fps=10)
CLIP = tumble.Clip(TIMES, KEYS)


def call(times=TIMES, keys=KEYS, **options):
    options = {"fps": 10, **options}
    return tumble.evaluate(times, keys, **options)


def changed(array, index, value):
    array = np.array(array)
    array[index] = value
    return array


def unaligned(array):
    """The same array, at an odd address."""
    store = np.zeros(array.nbytes + 1, np.uint8)
    other = store[1:].view(array.dtype).reshape(array.shape)
    other[...] = array
    return other


def read_only(array):
    array = array.copy()
    array.flags.writeable = False
    return array


class Dlpack:
    """Speaks DLPack and nothing else."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **options):
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


wide = np.zeros((3, 4, 8), np.float32)
wide[..., ::2] = KEYS

# Arguments that are accepted; each gives the same result as the plain form.
SAME = {
    "float64 keys": dict(keys=KEYS.astype(np.float64)),
    "float64 times": dict(times=TIMES.astype("f8")),
    "float32 times": dict(times=TIMES.astype("f4")),
    "times in a list": dict(times=TIMES.tolist()),
    "times in a tuple": dict(times=tuple(TIMES)),
    "keys in lists": dict(keys=KEYS.astype(float).tolist()),
    "keys in a list of arrays": dict(keys=list(KEYS)),
    "keys in Fortran order": dict(keys=np.asfortranarray(KEYS)),
    "keys with strides": dict(keys=wide[..., ::2]),
    "keys backwards in memory": dict(keys=KEYS[:, :, ::-1].copy()[:, :, ::-1]),
    "keys of the other byte order": dict(keys=KEYS.astype(">f4")),
    "times of the other byte order": dict(times=TIMES.astype(">f8")),
    "unaligned keys": dict(keys=unaligned(KEYS)),
    "unaligned times": dict(times=unaligned(TIMES)),
    "read-only keys": dict(keys=read_only(KEYS)),
    "read-only times": dict(times=read_only(TIMES)),
    "long double keys": dict(keys=KEYS.astype(np.longdouble)),
    "a memoryview": dict(keys=memoryview(KEYS)),
    "DLPack": dict(keys=Dlpack(KEYS.copy())),
    "a subclass of ndarray": dict(keys=KEYS.view(np.recarray)),
    "keys on the other side": dict(keys=changed(KEYS, 1, -KEYS[1])),
    "norms within 4e-7": dict(keys=KEYS.astype(float) * (1 + 1e-12)),
    "fps as text": dict(fps="10"),
    "fps as a fraction": dict(fps=Fraction(30, 3)),
    "fps of NumPy's": dict(fps=np.int64(10)),
    "fps as a float": dict(fps=10.0),
    "at instead of fps": dict(fps=None, at=np.arange(21) / 10),
    "times instead of at": dict(fps=None, times_=np.arange(21) / 10),
    "at of the other byte order": dict(fps=None, at=(np.arange(21) / 10).astype(">f8")),
    "at with strides": dict(fps=None, at=np.repeat(np.arange(21) / 10, 2)[::2]),
    "an output that is exactly right": dict(out=np.empty_like(EXPECTED)),
    "an output after a column": dict(out=np.zeros(EXPECTED.size + 3, "f4")[3:].reshape(3, 21, 4)),
    "None for what is left out": dict(method=None, ends=None, out=None),
}


@pytest.mark.parametrize("case", SAME)
def test_what_is_read_as_it_is_meant(case):
    options = dict(SAME[case])
    if "times_" in options:
        found = CLIP.evaluate(times=options.pop("times_"))
    else:
        found = call(**options)
    signs = np.sign((found * EXPECTED).sum(axis=-1, keepdims=True))
    assert found.shape == EXPECTED.shape
    assert np.array_equal(found * signs, EXPECTED) or np.abs(found * signs - EXPECTED).max() < 3e-7


# Empty arguments, and the shapes of their results.
EMPTY = {
    "no tracks": (dict(keys=np.empty((0, 4, 4))), (0, 1, 4)),
    "no times to evaluate": (dict(fps=None, at=[]), (3, 0, 4)),
    "no times for any track": (dict(fps=None, at=np.empty((3, 0))), (3, 0, 4)),
    "one key": (dict(times=[1.0], keys=KEYS[:, :1]), (3, 1, 4)),
    "one key of one track": (dict(times=[1.0], keys=KEYS[0, :1]), (1, 4)),
    "one time": (dict(fps=None, at=1.0), (3, 4)),
    "times a second apart and far away": (dict(times=TIMES + 1e15, fps=1), (3, 3, 4)),
    "times before the keys": (dict(fps=None, at=[-1e30, 1e30]), (3, 2, 4)),
}


@pytest.mark.parametrize("case", EMPTY)
def test_what_is_small_or_far(case):
    options, shape = EMPTY[case]
    found = call(**options)
    assert found.shape == shape
    assert np.isfinite(found).all()


locked = read_only(np.empty_like(EXPECTED))
inside = np.zeros(EXPECTED.size, np.float32)
inside[:48] = KEYS.ravel()

# Arguments that are refused, with the exception's code, its pointer, and a part of its message.
REFUSED = {
    "keys with a NaN": (dict(keys=changed(KEYS, (1, 2, 3), np.nan)), "E022", "keys[1][2]", "norm"),
    "keys with an infinity": (dict(keys=changed(KEYS, (0, 0, 0), np.inf)), "E022", "keys[0][0]", ""),
    "keys of norm 0": (dict(keys=changed(KEYS, (2, 3), 0)), "E025", "keys[2][3]", "norm is 0"),
    "keys of norm 2": (dict(keys=2 * KEYS), "E025", "keys[0][0]", "norm is 2"),
    "keys that f32 cannot hold": (dict(keys=KEYS.astype(float) * 1e300), "E022", "keys[0][0]", "norm"),
    "three components": (dict(keys=KEYS[..., :3]), None, None, "last axis"),
    "keys without axes": (dict(keys=1.0), None, None, "last axis"),
    "four axes": (dict(keys=KEYS[None]), None, None, "(keys, 4)"),
    "one quaternion": (dict(keys=KEYS[0, 0]), None, None, "(keys, 4)"),
    "complex keys": (dict(keys=KEYS.astype(complex)), None, None, "complex"),
    "keys of objects": (dict(keys=KEYS.astype(object)), None, None, "object"),
    "keys of text": (dict(keys=np.full((3, 4, 4), "x")), None, None, "<U1"),
    "bool keys": (dict(keys=KEYS > 0), None, None, "bool"),
    "no keys": (dict(times=[], keys=np.empty((3, 0, 4))), None, None, "no keys"),
    "None as keys": (dict(keys=None), None, None, "object"),
    "a masked array": (dict(keys=np.ma.masked_less(KEYS, 0)), None, None, "masked"),
    "lists that are not even": (dict(keys=[[[0, 0, 0, 1]], [[0, 0, 1]]]), None, None, "keys[1]"),
    "fewer times than keys": (dict(times=TIMES[:3]), None, None, "(frames, tracks, 4)"),
    "times for other tracks": (dict(times=np.stack([TIMES] * 2)), None, None, "2 tracks"),
    "times with three axes": (dict(times=np.zeros((1, 1, 4))), None, None, "times: the shape"),
    "one time for all keys": (dict(times=0.5), None, None, "times: the shape"),
    "times that stand still": (dict(times=[0, 1, 1, 2]), "E026", "times[0][2]", "does not come after"),
    "times that go back": (dict(times=[0, 2, 1, 3]), "E026", "times[0][2]", "does not come after"),
    "a time that is NaN": (dict(times=[0, 1, np.nan, 2]), "E022", "times[0][2]", "not finite"),
    "a time that is too far": (dict(times=[0, 1, 2, 1e39]), "E023", "times[0][3]", "±"),
    "dates as times": (dict(times=TIMES.astype("M8[s]")), None, None, "datetime64"),
    "no samples": (dict(fps=None), None, None, "give `fps`"),
    "fps and at": (dict(at=[0.0]), None, None, "exclude each other"),
    "fps of 0": (dict(fps=0), None, None, "not a frame rate"),
    "fps below 0": (dict(fps=-25), None, None, "not a frame rate"),
    "fps that is NaN": (dict(fps=float("nan")), None, None, "not a frame rate"),
    "fps that is a word": (dict(fps="film"), None, None, "`film` is not a frame rate"),
    "fps that is a bool": (dict(fps=True), None, None, "not a frame rate"),
    "more frames than memory": (dict(fps=10**15), None, None, "bytes"),
    "a sample at NaN": (dict(fps=None, at=[0.0, np.nan]), "E022", "at[1]", "time 1 is NaN"),
    "samples of three axes": (dict(fps=None, at=np.zeros((3, 1, 1))), None, None, "at: its shape"),
    "samples for other tracks": (dict(fps=None, at=np.zeros((2, 5))), None, None, "2 tracks"),
    "lists for other tracks": (dict(fps=None, at=[[0.0], [0.0, 1.0]]), None, None, "different"),
    "an end before the start": (dict(start=2.0, end=1.0), None, None, "before it starts"),
    "a start without a rate": (dict(fps=None, at=[0.0], start=1.0), None, None, "need `fps`"),
    "a start that is NaN": (dict(start=float("nan")), None, None, "start: NaN"),
    "an unknown method": (dict(method="slurp"), None, None, "slerp"),
    "an unknown order": (dict(order="xyz"), None, None, "wxyz"),
    "an unknown layout": (dict(layout="C"), None, None, "frame"),
    "unknown ends": (dict(ends="open"), None, None, "parabolic"),
    "ends of another shape": (dict(ends=[1, 2, 3]), None, None, "(2, 3)"),
    "an unknown wrap mode": (dict(after="repeat"), None, None, "mirror"),
    "a loop that is open": (dict(ends="loop"), None, "keys[0]", "loop"),
    "an output of float64": (dict(out=np.empty(EXPECTED.shape)), None, None, "float64"),
    "an output of the other byte order": (dict(out=np.empty(EXPECTED.shape, ">f4")), None, None, ">f4"),
    "an output of another shape": (dict(out=np.empty((3, 20, 4), "f4")), None, None, "(3, 21, 4)"),
    "an output with another number of axes": (dict(out=np.empty(252, "f4")), None, None, "(252,)"),
    "an output in Fortran order": (dict(out=np.asfortranarray(EXPECTED)), None, None, "C order"),
    "an output with gaps": (dict(out=np.empty((3, 21, 8), "f4")[..., ::2]), None, None, "C order"),
    "a read-only output": (dict(out=locked), None, None, "read-only"),
    "an unaligned output": (dict(out=unaligned(EXPECTED)), None, None, "aligned"),
    "an output over the keys": (
        dict(keys=inside[:48].reshape(3, 4, 4), out=inside.reshape(3, 21, 4)),
        None,
        None,
        "overwritten",
    ),
    "SciPy's rotations into an output": (dict(as_rotation=True, out=EXPECTED), None, None, "out"),
}


# Misspelt words of closed lists, each with the one that was meant.
MISSPELT = {
    "method": ("catmull_rom", "catmull-rom"),
    "ends": ("parabollic", "parabolic"),
    "layout": ("tracks", "track"),
    "order": ("wxzy", "wxyz"),
    "after": ("mirrored", "mirror"),
    "speed": ("konstant", "constant"),
    "signs": ("shortst", "shortest"),
}


@pytest.mark.parametrize("keyword", MISSPELT)
def test_a_similar_word_is_named(keyword):
    word, meant = MISSPELT[keyword]
    with pytest.raises(tumble.InputError) as caught:
        call(**{keyword: word})
    message = str(caught.value)
    assert f"there is no {'method ' if keyword == 'method' else ''}`{word}`; there are " in message
    assert message.endswith(f"; did you mean `{meant}`?"), message


def test_a_similar_word_is_named_by_other_functions(tmp_path):
    path = tmp_path / "a.tum"
    tumble.save(path, tumble.Clip(TIMES, KEYS[0]))
    engine = tumble.Engine("cpu")
    points = np.zeros((4, 3)) + TIMES[:, None]
    for wrong, meant, error in [
        (lambda: tumble.load(path, format="parqet"), "parquet", tumble.InputError),
        (lambda: tumble.load(path, duplicates="frist"), "first", tumble.InputError),
        (lambda: tumble.load(path)["bodi"], None, KeyError),
        (lambda: engine.velocity(CLIP, fps=10, axes="wrold"), "world", tumble.InputError),
        (lambda: engine.encoded(CLIP, "axisangle", fps=10), "axis-angle", tumble.InputError),
        (lambda: engine.follow(TIMES, points, fps=10, method="liner"), "linear", tumble.InputError),
        (lambda: CLIP.evaluate(fps=10, metod="slerp"), "method", TypeError),
    ]:
        with pytest.raises(error) as caught:
            wrong()
        message = str(caught.value)
        assert "there is no " in message and "; there are " in message
        if meant is not None:
            assert message.endswith(f"; did you mean `{meant}`?"), message
    with pytest.raises(tumble.InputError) as caught:
        call(method="xyz")
    assert "did you mean" not in str(caught.value)


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(case):
    options, code, pointer, words = REFUSED[case]
    with pytest.raises(tumble.InputError) as caught:
        call(**options)
    error = caught.value
    assert isinstance(error, ValueError) and isinstance(error, tumble.Error)
    assert (error.code, error.pointer) == (code, pointer), error
    assert words in str(error), error
    assert (error.file, error.line, error.column) == (None, None, None)


# Mistakes that are not about values raise Python's own exceptions.
OTHERS = {
    "an unknown keyword": (dict(speeed="constant"), TypeError, "speeed"),
    "at and times": (dict(fps=None, at=[0.0], times_=[0.0]), TypeError, "another name"),
    "an output that is a list": (dict(out=[]), TypeError, "list"),
    "a method that is a number": (dict(method=3), TypeError, "text"),
    "a start that is text": (dict(start="soon"), TypeError, "seconds"),
    "a result larger than memory": (dict(fps=10**11), MemoryError, None),
}


@pytest.mark.parametrize("case", OTHERS)
def test_what_python_has_exceptions_for(case):
    options, kind, words = OTHERS[case]
    options = dict(options)
    with pytest.raises(kind, match=words):
        if "times_" in options:
            CLIP.evaluate(at=options["at"], times=options["times_"])
        else:
            call(**options)


def test_tracks_and_clips_that_are_not_there():
    clip = tumble.Clip(TIMES, KEYS, names=["a", "b", "c"])
    for wrong, kind in [("d", KeyError), (3, IndexError), (-4, IndexError), (1.5, TypeError)]:
        with pytest.raises(kind):
            clip.keys(wrong)
    assert np.array_equal(clip.keys(-1), clip.keys("c"))
    wrong = [
        dict(names=["a"]),
        dict(parents=[None, 0]),
        dict(parents=[None, 0, 3]),
        dict(parents=[0, None, None]),
        dict(offsets=np.zeros((3, 2))),
        dict(offsets=np.full((3, 3), np.nan)),
        dict(translations=np.zeros((3, 4, 2))),
        dict(translations=[np.zeros((4, 3)), None]),
        dict(translations=np.full((3, 4, 3), np.inf)),
        dict(velocities=np.zeros((2, 4, 3))),
    ]
    for options in wrong:
        with pytest.raises(tumble.InputError):
            tumble.Clip(TIMES, KEYS, **options)
    for parents in [[1, 0, None], [None, 2, 1], [1, 2, 0]]:
        with pytest.raises(tumble.InputError, match="track . .`[abc]`. is its own ancestor"):
            tumble.Clip(TIMES, KEYS, names=["a", "b", "c"], parents=parents)
    assert tumble.Clip(TIMES, KEYS, parents=[1, 2, -1]).parents == [1, 2, None]


def test_devices_that_are_not_there():
    with pytest.raises(tumble.Error):
        tumble.Engine("abacus")
    with pytest.raises(TypeError):
        tumble.Engine(speed=3)


def test_the_tables_are_as_long_as_promised():
    assert len(SAME) + len(EMPTY) + len(REFUSED) + len(OTHERS) >= 100


def test_keys_of_frames_are_read_by_their_layout():
    """(frames, tracks, 4), as engines of physics and of machine learning hold poses."""
    by_frame = np.swapaxes(KEYS, 0, 1)
    moves = np.arange(36.0).reshape(3, 4, 3)
    moves_by_frame = np.swapaxes(moves, 0, 1)
    expected = tumble.Clip(TIMES, KEYS, translations=moves, velocities=moves)
    found = tumble.Clip(
        TIMES, by_frame, layout="frame", translations=moves_by_frame, velocities=list(moves_by_frame)
    )
    assert found == expected
    # A list that contains None is a list of tracks. Other lists of the same length are lists of frames.
    rooted = tumble.Clip(TIMES, KEYS, translations=[moves[0], None, None])
    assert tumble.Clip(TIMES, by_frame, layout="frame", translations=[moves[0], None, None]) == rooted
    square = [KEYS[:, :3], np.arange(27.0).reshape(3, 3, 3)]
    tracks = tumble.Clip(TIMES[:3], square[0], layout="track", translations=square[1], scales=1 + square[1])
    keys, moves_of_frames = (np.swapaxes(array, 0, 1) for array in square)
    frames = tumble.Clip(
        TIMES[:3], list(keys), layout="frame", translations=list(moves_of_frames), scales=list(1 + moves_of_frames)
    )
    assert frames == tracks
    with pytest.raises(tumble.InputError, match=r"velocities: the shape is \(3, 4, 3\); give \(frames, 3, 3\), or a list"):
        tumble.Clip(TIMES, by_frame, layout="frame", velocities=list(moves))
    assert tumble.Clip(TIMES, list(by_frame), layout="frame") == CLIP
    for call_of_it in (tumble.Clip, lambda *of: tumble.evaluate(*of, fps=10)):
        with pytest.raises(tumble.InputError, match=r'layout="frame".*swapaxes\(keys, 0, 1\)'):
            call_of_it(TIMES, by_frame)
    with pytest.raises(tumble.InputError, match=r'of layout="track", \(tracks, keys, 4\)'):
        tumble.Clip(TIMES, KEYS, layout="frame")
    with pytest.raises(tumble.InputError, match=r"translations: the shape is \(3, 4, 3\); give \(frames, 3, 3\)"):
        tumble.Clip(TIMES, by_frame, layout="frame", translations=moves)


def test_as_many_tracks_as_keys_need_a_layout(rng):
    keys, times = unit(rng, 5, 5), np.arange(5.0)
    both = r'both axes may be the axis of the frames; state which one it is by {}layout="track"'
    with pytest.raises(tumble.InputError, match=both.format("")):
        tumble.Clip(times, keys)
    with pytest.raises(tumble.InputError, match=both.format(r"Clip\(times, keys, ")):
        tumble.evaluate(times, keys, fps=2)
    track = tumble.Clip(times, keys, layout="track")
    with pytest.warns(tumble.InputWarning, match=r"read as \(tracks, keys, 4\); say so by layout="):
        named = tumble.Clip(times, keys, names=list("abcde"))
    assert np.array_equal(named.keys("b"), keys[1])
    assert np.array_equal(track.keys(1), keys[1])
    assert np.array_equal(tumble.Clip(times, keys, layout="frame").keys(1), keys[:, 1])
    # If times or lists are given for each track, the axes are known without `layout`.
    assert tumble.Clip([times] * 5, keys) == tumble.Clip(times, list(keys)) == track


def test_times_of_a_clock_count_from_a_whole_second(tmp_path):
    """As those of files; the exact values are those of the turn by 180 degrees."""
    times = 1.7e9 + np.array([0.25, 0.75, 1.25])
    keys = [[0, 0, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]]
    clip = tumble.Clip(times, keys)
    assert (clip.time_offset, clip.span) == (1_700_000_000, (0.25, 1.25))
    for at in (0.75, 1_700_000_000.75):
        assert clip.evaluate(at=at, method="slerp").tolist() == [[0, 0, 1, 0]]
        assert tumble.evaluate(times, keys, at=at, method="slerp").tolist() == [0, 0, 1, 0]
    assert tumble.Clip([times, times + 1], [keys, keys]).time_offset == 1_700_000_000
    assert tumble.Clip(times - 1.7e9, keys).time_offset == 0
    path = tmp_path / "clock.tum"
    tumble.save(path, clip)
    loaded = tumble.load(path).clip
    assert (loaded.time_offset, loaded.times(0).tolist()) == (clip.time_offset, clip.times(0).tolist())
    with pytest.raises(tumble.InputError, match=r"0.25 s.*\(times are counted from second 1700000000\)"):
        tumble.Clip(times[[0, 0, 1]], keys)


LARGE = {
    "times": lambda of: tumble.Clip(of(0.0), KEYS[0]),
    "keys": lambda of: tumble.Clip(TIMES, of([0.0, 0.0, 0.0, 1.0])),
    "keys in float32": lambda of: tumble.Clip(TIMES, of(np.float32([0.0, 0.0, 0.0, 1.0]))),
    "whole numbers": lambda of: tumble.Clip(of(0), KEYS[0]),
    "parents": lambda of: tumble.Clip(TIMES, KEYS[0], parents=of(0)),
    "names": lambda of: tumble.Clip(TIMES, KEYS[0], names=of("a")),
    "offsets": lambda of: tumble.Clip(TIMES, KEYS[0], parents=[None], offsets=of([0.0] * 3)),
    "translations": lambda of: tumble.Clip(TIMES, KEYS[0], translations=of([0.0] * 3)),
    "at": lambda of: CLIP.evaluate(at=of(0.5)),
    "evaluate": lambda of: tumble.evaluate(of(0.0), KEYS[0], fps=1),
    "poses": lambda of: tumble.Engine("cpu").poses(CLIP, at=of(0.5)),
    "smooth": lambda of: tumble.Engine("cpu").smooth(of([0.0, 0.0, 0.0, 1.0])),
    "vectors": lambda of: tumble.Engine("cpu").smooth(of([0.0, 0.0, 0.0])),
    "blend": lambda of: tumble.Engine("cpu").blend([of([0.0, 0.0, 0.0, 1.0])]),
    "weights": lambda of: tumble.Engine("cpu").blend([KEYS], of(1.0)),
    "mix": lambda of: tumble.Engine("cpu").mix(KEYS, of([0.0, 0.0, 0.0, 1.0]), 0.5),
    "add": lambda of: tumble.Engine("cpu").add(of([0.0, 0.0, 0.0, 1.0]), KEYS),
    "local_to_model": lambda of: tumble.Engine("cpu").local_to_model(KEYS[:, 0], of(-1)),
    "follow": lambda of: tumble.Engine("cpu").follow(None, of([0.0] * 3), duration=1, fps=1),
    "compare": lambda of: tumble.compare(of(0.0), of(0.0)),
    "surface": lambda of: tumble.Surface(of([0.0] * 3), [[0, 1, 2]]),
    "faces": lambda of: tumble.Surface(np.eye(3), of([0, 1, 2])),
    "net": lambda of: tumble.Surface.net(np.broadcast_to(0.0, (2**20, 2**20, 3))),
    "library": lambda of: LIBRARY.sample(of(0), of(0.0)),
    "crowd": lambda of: CROWD.set(of(0), 0),
    "masks": lambda of: tumble.Crowd([BODY], 1, masks=[of(1.0)]),
    "linear": lambda of: tumble.save("x.npz", CLIP, linear=of("a")),
}
BODY = tumble.Clip(TIMES, KEYS, parents=[None, 0, 1], offsets=np.ones((3, 3)))
LIBRARY = tumble.MotionLibrary([BODY])
CROWD = tumble.Crowd([BODY], 3)


@pytest.mark.parametrize("case", LARGE)
def test_an_array_that_is_larger_than_memory_is_a_memory_error(case):
    """The elements of an array that is broadcast share memory; a copy of it has no room."""

    def of(row):
        row = np.asarray(row)
        return np.broadcast_to(row, (2**40, *row.shape))

    with pytest.raises(MemoryError):
        LARGE[case](of)
