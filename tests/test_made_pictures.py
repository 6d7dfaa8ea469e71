"""Pictures that are made of others, in another colour space."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("MaterialX")
import kanuka
from kanuka.looks import pictures
from test_color_config import CODE, film, house, shaded
from test_texture_spaces import flat


def numbers(size: int = 24) -> np.ndarray:
    return np.random.default_rng(3).random((size, size, 3)).astype(np.float32)


def test_a_picture_is_converted_texel_by_texel_and_kept(tmp_path: Path):
    """Nothing but halfs' rounding is lost; the second time nothing is written; another content is another file."""
    config, source = house(tmp_path), str(tmp_path / "noise.exr")
    rgb, alpha = numbers(), numbers()[..., 0]
    rgb[3, 4] = (np.nan, np.inf, -1)
    kanuka.Picture({"rgb": rgb, "alpha": alpha}).write(source)
    made = config.named("film", "rec709").picture(source)
    found = kanuka.read(made)
    expected = film(rgb)
    expected[3, 4] = found["rgb"][3, 4]  # which only must be finite
    assert found["rgb"] == pytest.approx(expected, rel=2**-11, abs=1e-6) and np.isfinite(found["rgb"]).all()
    assert found["alpha"] == pytest.approx(alpha, rel=2**-11)
    assert b"half" not in Path(made).name.encode() and Path(made).parent == Path(kanuka.texture_cache_folder())
    assert made in [each["file"] for each in kanuka.texture_cache_files()]
    written = Path(made).stat().st_mtime_ns
    assert config.named("film", "rec709").picture(source) == made and Path(made).stat().st_mtime_ns == written
    kanuka.Picture({"rgb": numbers()}).write(source)
    assert config.named("film", "rec709").picture(source) != made
    assert config.named("film", "acescg").picture(source) != config.named("film", "rec709").picture(source)


def test_another_table_under_the_same_name_makes_another_picture(tmp_path: Path):
    source = flat(tmp_path, CODE)
    first = house(tmp_path).named("film", "rec709").picture(source)
    (tmp_path / "other").mkdir()
    other = house(tmp_path / "other")
    (tmp_path / "other/film.spi1d").write_text("Version 1\nFrom 0 1\nLength 2\nComponents 1\n{\n0\n0.5\n}\n")
    second = other.named("film", "rec709").picture(source)
    assert second != first and kanuka.read(second)["rgb"][3, 3] == pytest.approx(np.array(CODE) / 2, abs=2e-3)


def test_codes_of_8_bits_are_read_exactly(tmp_path: Path):
    codes = np.arange(256).reshape(16, 16) / 255
    light = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    path = tmp_path / "all.png"
    kanuka.Picture({"rgb": np.stack([light, light.T, light[::-1]], -1).astype(np.float32)}).write(path)
    read = pictures.read(str(path), str(tmp_path))
    found = read.rgb
    assert read.codes and np.array_equal(np.round(found * 255), np.stack([codes, codes.T, codes[::-1]], -1) * 255)
    assert found == pytest.approx(np.round(found * 255) / 255, abs=1e-7)


def test_half_floats_are_written_as_they_are(tmp_path: Path):
    for channels in (3, 4):
        values = np.random.default_rng(5).normal(size=(5, 7, channels)) * 100
        pictures.write_half(str(tmp_path / "h.exr"), values)
        found = kanuka.read(tmp_path / "h.exr")
        assert np.array_equal(found["rgb"], values[..., :3].astype(np.float16))
        if channels == 4:
            assert np.array_equal(found["alpha"], values[..., 3].astype(np.float16))


def test_tiles_are_converted_one_by_one(tmp_path: Path):
    """Two tiles of different colours, seen side by side."""
    for number, rgb in ((1001, (0.25, 0.5, 0.75)), (1002, (0.75, 0.25, 0.5))):
        kanuka.Picture({"rgb": np.full((8, 8, 3), rgb, np.float32)}).write(tmp_path / f"t.{number}.exr")
    made = house(tmp_path).named("film", "rec709").picture(str(tmp_path / "t.<UDIM>.exr"))
    assert "<UDIM>" in made
    for number, rgb in ((1001, (0.25, 0.5, 0.75)), (1002, (0.75, 0.25, 0.5))):
        found = kanuka.read(made.replace("<UDIM>", str(number)))
        assert found["rgb"][4, 4] == pytest.approx(film(rgb), abs=1e-3)
    _, seen, told = shaded(house(tmp_path), "film", str(tmp_path / "t.<UDIM>.exr"))
    assert seen == pytest.approx(film((0.25, 0.5, 0.75)), abs=1e-3) and told == []
