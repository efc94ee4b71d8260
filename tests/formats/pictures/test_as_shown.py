"""What a model gets of a picture is what a browser shows of it on white."""

import base64
import io
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageOps

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.blank import blank_like

WIDTH, HEIGHT = 12, 8
DRAW = np.random.default_rng(0)
RGB = DRAW.integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8)
ALPHA = DRAW.integers(0, 256, (HEIGHT, WIDTH), dtype=np.uint8)
GREY16 = DRAW.integers(0, 65_536, (HEIGHT, WIDTH), dtype=np.uint16)
# JPEG keeps a smooth picture nearly as it is.
SMOOTH = Image.fromarray(RGB[:2, :3]).resize((WIDTH, HEIGHT), Image.Resampling.BICUBIC)
SCRIPT = """async url => {
  const image = new Image(); image.src = url; await image.decode();
  const canvas = document.createElement('canvas'), pen = canvas.getContext('2d');
  canvas.width = image.naturalWidth; canvas.height = image.naturalHeight;
  pen.fillStyle = 'white'; pen.fillRect(0, 0, canvas.width, canvas.height);
  pen.drawImage(image, 0, 0);
  return [canvas.width, canvas.height, ...pen.getImageData(0, 0, canvas.width, canvas.height).data];
}"""

Save = Callable[..., FrameRef]


@pytest.fixture
def save(tmp_path: Path) -> Save:
    def save(picture: Image.Image, kind: str = "PNG", **how: Any) -> FrameRef:
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.{kind.lower()}"
        picture.save(path, kind, **how)
        return FrameRef(path)

    return save


def _pixels(frame: FrameRef) -> np.ndarray:
    return np.asarray(frame.load(), dtype=int)


def _on_white(colours: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    share = alpha[..., None] / 255
    return colours * share + 255 * (1 - share)


def _turned(orientation: int) -> Image.Exif:
    exif = Image.Exif()
    exif[0x0112] = orientation
    return exif


def _chunk(name: bytes, content: bytes) -> bytes:
    check = zlib.crc32(name + content)
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", check)


def test_16_bits_of_grey_are_read_as_8(save):
    frame = save(Image.fromarray(GREY16))
    assert (_pixels(frame) == (GREY16 >> 8)[..., None]).all()
    assert frame.conversions == "16-bit grey"
    frame = save(Image.fromarray(GREY16), transparency=int(GREY16[2, 3]))
    assert _pixels(frame)[2, 3].tolist() == [255, 255, 255]
    assert frame.conversions == "16-bit grey, transparency on white"


@pytest.mark.parametrize("kind", ["PNG", "WEBP"])
def test_nothing_shows_of_colours_under_transparency(save, kind):
    layer = np.dstack([RGB, ALPHA])
    layer[0, :, 3], layer[1, :, 3] = 0, 255
    frame = save(Image.fromarray(layer), kind, lossless=True, exact=True)
    assert _pixels(frame) == pytest.approx(_on_white(RGB, layer[..., 3]), abs=1)
    assert (_pixels(frame)[0] == 255).all()
    assert (_pixels(frame)[1] == RGB[1]).all()
    assert frame.conversions == "transparency on white"
    assert (np.asarray(Image.open(io.BytesIO(frame.png()))) == _pixels(frame)).all()


def test_grey_with_transparency_and_palettes_lie_on_white(save):
    grey = save(Image.fromarray(np.dstack([RGB[..., 0], ALPHA])))  # LA
    assert _pixels(grey) == pytest.approx(_on_white(RGB[..., :1].repeat(3, 2), ALPHA), abs=1)
    palette = Image.fromarray(RGB).quantize(16)
    index, colours = np.asarray(palette), np.asarray(palette.convert("RGB"))
    one = save(palette, transparency=3)
    assert (_pixels(one) == np.where((index == 3)[..., None], 255, colours)).all()
    each = save(palette, transparency=bytes(range(0, 256, 16)))
    assert _pixels(each) == pytest.approx(_on_white(colours, index * 16), abs=1)
    clear = save(Image.fromarray(RGB), transparency=tuple(map(int, RGB[0, 0])))
    assert _pixels(clear)[0, 0].tolist() == [255, 255, 255]
    assert {one.conversions, each.conversions, clear.conversions} == {"transparency on white"}


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP"])
@pytest.mark.parametrize("orientation", range(2, 9))
def test_pictures_are_turned_as_their_exif_data_say(save, kind, orientation):
    frame = save(SMOOTH, kind, exif=_turned(orientation))
    with Image.open(frame.path) as stored:
        expected = ImageOps.exif_transpose(stored).convert("RGB")
    assert frame.load().tobytes() == expected.tobytes()
    assert frame.size == frame.load().size == expected.size
    assert frame.conversions == f"EXIF orientation {orientation}"
    content, media_type = frame.encoded()
    assert media_type == "image/png"
    assert Image.open(io.BytesIO(content)).tobytes() == expected.tobytes()


def test_blank_frames_have_the_size_that_is_shown(save):
    assert blank_like(save(SMOOTH, exif=_turned(6))).size == (HEIGHT, WIDTH)


def test_what_needs_nothing_is_left_as_it_is(save):
    palette = Image.fromarray(RGB).quantize(16)
    late = save(SMOOTH)  # browsers have drawn the picture when they come to it
    late_data = _chunk(b"eXIf", _turned(6).tobytes()[6:]) + _chunk(b"IEND", b"")
    late.path.write_bytes(late.path.read_bytes()[:-12] + late_data)
    for frame in (
        save(SMOOTH),
        save(SMOOTH, "JPEG"),
        save(SMOOTH, "WEBP", lossless=True),
        save(palette),
        save(SMOOTH.convert("L")),
        save(SMOOTH.convert("1")),
        *(save(SMOOTH, exif=exif) for exif in (_turned(1), _turned(9), b"no data", b"MM")),
        save(SMOOTH, "JPEG", exif=b"Exif\0\0no data"),
        late,
    ):
        with Image.open(frame.path) as stored:
            media_type = f"image/{stored.format.lower()}"
            assert frame.load().tobytes() == stored.convert("RGB").tobytes()
            assert frame.size == stored.size
        assert frame.conversions == ""
        assert frame.encoded() == (frame.path.read_bytes(), media_type)


@pytest.mark.filterwarnings("error")
def test_a_browser_shows_the_same(save, browser):
    layer = Image.fromarray(np.dstack([RGB, ALPHA]))
    frames = [
        save(Image.fromarray(GREY16)),
        save(Image.fromarray(GREY16), transparency=int(GREY16[2, 3])),
        save(layer),
        save(layer.convert("LA")),
        save(layer, "WEBP", lossless=True, exact=True),
        save(Image.fromarray(RGB).quantize(16), transparency=bytes(range(0, 256, 16))),
        save(SMOOTH.convert("CMYK"), "JPEG", quality=95),
        *(save(SMOOTH, kind, exif=_turned(n)) for kind in ("PNG", "JPEG") for n in range(10)),
    ]
    tab = browser.new_page()
    for frame in frames:
        kind = frame.path.suffix.removeprefix(".")
        content = base64.b64encode(frame.path.read_bytes()).decode()
        width, height, *shown = tab.evaluate(SCRIPT, f"data:image/{kind};base64,{content}")
        assert frame.size == (width, height)
        pixels = np.reshape(shown, (height, width, 4))[..., :3]
        assert _pixels(frame) == pytest.approx(pixels, abs=1), frame.conversions
