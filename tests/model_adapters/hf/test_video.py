"""Videos: their tokens against the published counts, and replies against transformers' own
processor and `generate`."""

import gzip
import json
from pathlib import Path

import pytest
import torch

from infthor_eval.errors import DataError, ModelError
from infthor_eval.formats.pictures.video import FILM_FPS, sample_positions
from model_adapters import Video, load
from model_adapters.hf.family import ClipShape

from ..asking import ask, load_saved, require_same, talk_of, up_to, user

LOGS = Path(__file__).parents[4] / "../shared/data/published_sets/replies"
QUESTION = "\nWhat do you see?"
MARKERS = 2  # around a video of Qwen2.5-VL


@pytest.fixture(scope="module")
def published(make_frames):
    """A frame of the published size."""
    (frame,) = make_frames(1, 300, 300)
    return frame


def vision_tokens(model, video):
    without, with_it = (talk_of(model, user(*more, QUESTION)) for more in ((), (video,)))
    return with_it.n_tokens - without.n_tokens


def published_tokens(n_frames, fps):
    """Vision tokens of the published logs of video input: counted there, of every trajectory."""
    return 144 * (n_frames * fps // 10 // 2)


@pytest.fixture(scope="module")
def tokens_of_sampled(tiny, published):
    """Vision tokens of a request, without markers, by the number of sampled frames."""
    talk = tiny.conversation()
    talk.append(QUESTION)
    without, start, tokens = talk.n_tokens + MARKERS, talk.mark(), {}
    for n in range(56, 246, 2):
        talk.append(Video((published,) * n, 1.0))
        tokens[n] = talk.n_tokens - without
        talk.rewind(start)
    return tokens


@pytest.mark.parametrize("fps", [1, 2])
def test_a_film_takes_the_published_number_of_tokens_whatever_its_length(tokens_of_sampled, fps):
    for n_frames in range(570, 1224):
        sampled = sample_positions(n_frames, FILM_FPS, fps)
        assert tokens_of_sampled[len(sampled)] == published_tokens(n_frames, fps), n_frames
        assert (sampled[0], sampled[-1]) == (0, n_frames - 1)


@pytest.mark.skipif(not LOGS.is_dir(), reason="the published logs are not at ../shared/data")
def test_every_published_trajectory_takes_its_number_of_tokens(tokens_of_sampled):
    n_frames = {}
    for log in LOGS.glob("*_full_traj.log.gz"):
        with gzip.open(log, "rt") as lines:
            rows = [json.loads(line) for line in lines]
        n_frames |= {row["traj_id"]: row["n_imgs"] for row in rows}
    assert (len(n_frames), min(n_frames.values()), max(n_frames.values())) == (208, 570, 1223)
    for traj_id, n in n_frames.items():
        for fps in (1, 2):
            assert tokens_of_sampled[len(sample_positions(n, FILM_FPS, fps))] == published_tokens(
                n, fps
            ), traj_id


def test_a_frame_of_a_video_takes_196_tokens_of_llava_onevision(published):
    model = load("llava-onevision-tiny", {}, seed=0)
    assert [vision_tokens(model, Video((published,) * n, 1.0)) for n in (1, 2, 56)] == [
        197,
        393,
        56 * 196 + 1,
    ]
    model.close()


def test_replies_are_those_of_the_whole_processor_and_generate(
    checkpoints, answer_plainly, make_frames
):
    """Frames have the size that they are scaled to, as PIL and torchvision scale differently.

    Eight frames a second, so that no time of Qwen2.5-VL's clips is beyond their rows, where
    transformers 5 numbers the text behind the video in its own way.
    """
    new, requests = 6, {}
    for family, side in (("qwen2.5-vl", 336), ("llava-onevision", 384)):
        frames = make_frames(5, side, side, seed=3)
        requests[family] = [
            user(Video(tuple(frames[:4]), 8.0), QUESTION),
            user(
                "Before: ",
                Video(tuple(frames[:3]), 8.0),
                " after: ",
                Video(tuple(frames[2:]), 8.0),
                QUESTION,
            ),
        ]
    answers = answer_plainly(
        {checkpoints[family]: turns for family, turns in requests.items()}, new
    )
    for family, turns in requests.items():
        model = load_saved(family, checkpoints[family])
        for one, (ids, reply) in zip(turns, answers[checkpoints[family]], strict=True):
            require_same(model, one, ids, reply, new)
        model.close()


def test_sharing_and_chunks_change_no_reply(tiny, plain, make_frames):
    frames = make_frames(4, 300, 300)
    films = [Video(tuple(frames), 1.0), Video(tuple(frames[:2]), 1.0), Video(tuple(frames), 0.5)]
    requests = [(video, f"\nIs there a {name}?") for video in films for name in ("mug", "bed")]
    requests += [
        (films[0], "Then ", frames[0], "\nWhat now?"),
        (frames[1], films[1], "\nWhat now?"),
    ]
    for parts in requests:
        assert ask(tiny, *parts, new=6).token_ids == ask(plain, *parts, new=6).token_ids
    talk = talk_of(tiny, user(films[0]))
    _, two = talk.replies([["\nIs it?"], ["\nWhat is it?"]], up_to(1))
    assert two.n_cached_tokens >= 2 * 144


def test_the_rate_and_the_order_of_frames_change_the_prompt(tiny, frames):
    videos = [
        Video(tuple(frames), 1.0),
        Video(tuple(frames), 2.0),
        Video(tuple(reversed(frames)), 1.0),
    ]
    first, *others = [tiny.pieces(user(video, QUESTION)) for video in videos]
    assert first not in others


def test_two_equal_frames_have_the_features_of_their_image(tiny, published):
    family, image = tiny._loaded.family, published.load()
    shape = ClipShape(image.size, 0, 1, 2.0)
    with torch.inference_mode():
        (clip,) = family.video.features_of([(shape, family.video.prepare(shape, [image, image]))])
        (still,) = family.features([image.resize((336, 336), resample=3)])
    torch.testing.assert_close(clip, still, atol=1e-3, rtol=1e-3)


def test_positions_count_the_time_of_a_video_and_go_on_behind_it(tiny):
    """By hand: two rows and columns, four positions a second, clips two seconds apart, text before
    and behind."""
    family = tiny._loaded.family
    shapes = [ClipShape((56, 56), number, 3, 2.0) for number in range(3)]
    n = family.video.n_tokens(shapes[0])
    side = int(n**0.5)
    ids = torch.tensor([5, 6, *[family.video.placeholder_id] * (3 * n), 7])
    positions = family.positions(ids, shapes, 0)[:, 0]
    time = [2] * n + [2 + 8] * n + [2 + 16] * n
    assert positions[0].tolist() == [0, 1, *time, 19]
    assert positions[1].tolist() == [0, 1, *[2 + at // side for at in range(n)] * 3, 19]
    assert positions[2].tolist() == [0, 1, *[2 + at % side for at in range(n)] * 3, 19]


def test_a_models_own_token_of_a_video_has_the_position_of_a_text(tiny):
    placeholder = tiny._loaded.family.video.placeholder_id
    assert tiny._loaded.family.positions(torch.tensor([placeholder]), [], 7).tolist() == [[[7]]] * 3


def test_models_without_a_video_input_refuse_videos(frames):
    for name in ("pixtral-tiny", "qwen2.5-vl-nano"):
        model = load(name, {}, seed=0)
        with pytest.raises(
            ModelError, match=f"{name} has no video input; give it the video's frames as images"
        ):
            ask(model, Video(tuple(frames), 1.0), QUESTION)
        model.close()


def test_a_plain_prompt_has_videos_too(frames):
    model = load("qwen2.5-vl-tiny", {"prompt": "plain"}, seed=0)
    assert model.capabilities.video_input
    assert vision_tokens(model, Video(tuple(frames), 1.0)) == 3 * 144 + MARKERS
    model.close()


def test_a_text_with_the_token_of_a_video_is_refused(tiny):
    with pytest.raises(
        ModelError, match=r"1 video placeholders for 0 videos; a text must not contain .*video_pad"
    ):
        tiny.pieces(user("<|video_pad|> what?"))


def test_frames_of_a_video_have_one_size(tiny, published, make_frames):
    (other,) = make_frames(1, 200, 300)
    with pytest.raises(
        DataError,
        match=r"\.png: has another size than the video's first frame; give frames of one size",
    ):
        tiny.pieces(user(Video((published, other), 1.0), "?"))


def test_the_pixels_of_long_videos_are_shared_by_their_frames(tiny):
    """By hand from qwen-vl-utils: of 768 frames, each has 128000 * 28 * 28 * 0.9 * 2 / 768 pixels:
    300 tokens."""
    large = (1400, 1400)
    tokens = [tiny._loaded.family.video.n_tokens(ClipShape(large, 0, n, 1.0)) for n in (2, 384)]
    # 768 tokens and 300 are the most, in whole rows and columns.
    assert tokens == [27 * 27, 17 * 17]
